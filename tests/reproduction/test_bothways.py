"""`tenbaud figures bothways`: narrow downlinks beside the full one, from nothing to the page."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from reproduction.bothways import study
from reproduction.bothways.page import AIMS
from reproduction.bothways.study import Found, Point, aims, corruptions, fly, grid, symbols_of
from tenbaud.cli.commands import app


def test_when_the_study_is_asked_for_then_page_pictures_and_points_are_there_and_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    done = CliRunner().invoke(app, ["figures", "bothways", "--quick", "--docs", str(tmp_path)])
    assert done.exit_code == 0, done.output
    pictures = tmp_path / "figures"
    for name in ("bothways-errors", "bothways-lists"):
        assert (pictures / f"{name}.png").stat().st_size > 10_000
        assert (pictures / f"{name}.svg").read_text().startswith("<?xml")
    kept = (pictures / "bothways.json").read_text()
    assert len(json.loads(kept)["points"]) == len(grid(quick=True))
    page = (tmp_path / "BOTHWAYS.md").read_text()
    assert "quick form" in page
    assert "### pitch: coded commands" in page
    assert "| loss 5 % |" in page
    assert "nan" not in page

    monkeypatch.setattr(study, "fly", None)  # what is kept is not flown again
    assert study.fly_all(grid(quick=True), pictures / "bothways.json", lambda *_: None)
    assert (pictures / "bothways.json").read_text() == kept


def test_a_narrow_flight_of_either_subject_is_as_good_as_a_full_one_on_a_clean_line() -> None:
    for point in (
        Point("pitch", "announced", 40, seeds=1, samples=150),
        Point("helicopter", "announced", 40, seeds=1, samples=80),
        Point("pitch", "coded", 40, trip=1, seeds=1, samples=150),
    ):
        found = fly(point)
        assert found.wrong == 0
        assert found.confirmed > 0.8 * point.samples - 20
        assert 0.8 < found.error < 1.25, point
        assert 0.9 < found.tracking < 1.25, point


def test_loss_costs_a_slow_downlink_more_than_a_fast_one() -> None:
    slow, fast = (
        fly(Point("pitch", "announced", baud, loss=0.02, seeds=1, samples=150)) for baud in (10, 40)
    )
    assert slow.size > 3.0 * fast.size
    assert slow.delay > 2.0 * fast.delay
    assert slow.cpu > fast.cpu


def test_every_corruption_is_found_soon() -> None:
    median, largest = corruptions(at_receiver=True, count=6)
    assert 1 <= median <= 12
    assert largest < 40


def test_every_aim_has_a_point_that_is_flown() -> None:
    assert aims().keys() == AIMS.keys()
    assert {one.subject for one in grid()} == {"pitch", "helicopter"}
    assert all(symbols_of(one) >= 1 for one in grid())
    assert set(Found.__dataclass_fields__) >= {"error", "tracking", "delay", "size", "rejoins_h", "cpu"}


def test_a_rate_below_one_symbol_a_sample_is_refused() -> None:
    with pytest.raises(ValueError, match="symbol"):
        fly(Point("helicopter", "announced", 10, seeds=1, samples=1))
