"""`tenbaud bench coders` from nothing to page and pictures, at the smallest scale with intervals."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

from reproduction.limits import plan
from reproduction.limits.candidates import CANDIDATES, TUNED
from reproduction.limits.plan import DENSITIES, Scale
from tenbaud.cli.commands import app

SMALL = Scale(2, 14.0, 2, 30.0)


@pytest.mark.soak
def test_when_the_bench_has_flown_then_page_and_pictures_are_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(plan, "QUICK", SMALL)
    done = CliRunner().invoke(app, ["bench", "coders", "--quick", "--docs", str(tmp_path)])
    assert done.exit_code == 0, done.output
    page = (tmp_path / "LIMITS.md").read_text()
    for candidate in CANDIDATES:
        # One row per density in two tables, one behind the encoder, one seed by seed with the tuned.
        assert page.count(f"| {candidate.name}") == 2 * len(DENSITIES) + 1 + (candidate.key != TUNED)
    assert "tenbaud bench coders --quick" in page
    assert f"{SMALL.seeds} seeds of {SMALL.seconds:g} s" in page
    for name in ("limits.png", "limits-disturbance.png"):
        assert (tmp_path / "figures" / name).stat().st_size > 10_000


def test_when_the_data_folder_is_wrong_then_it_is_named_before_anything_flies(tmp_path: Path) -> None:
    done = CliRunner().invoke(app, ["bench", "coders", "--quick", "--data", str(tmp_path)])
    assert done.exit_code != 0
    assert str(tmp_path) in str(done.exception)
