"""Which sources stand for the figures of a flight."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from tenbaud.studies import compiled as compiling
from tenbaud.studies.compiled import BESIDE, figure_sources, named
from tests.rules.sources import TOP


def test_whatever_turns_a_configuration_into_a_flight_is_among_the_sources() -> None:
    found = figure_sources()
    for name in (
        "channel/codec/coders/zoom.py",
        "tenbaud/build/codec.py",
        "tenbaud/config/schema.py",
        "tenbaud/flight/transmit.py",
        "tenbaud/studies/kernel.py",
        "transmitter/metrics/scores.py",
    ):
        assert TOP / name in found, f"results would outlive a change of {name}"
    assert len(found) == len(set(found))


def test_what_is_left_out_is_there_and_only_draws_or_keeps_results() -> None:
    for name in BESIDE:
        assert (TOP / name).is_file()
        assert TOP / name not in figure_sources()


def test_machine_code_is_found_again_wherever_the_sources_lie(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(compiling, "_cache_folder", lambda: tmp_path)
    hits = []
    for folder in ("here", "elsewhere", "elsewhere, on another line"):
        lines = "\n" * folder.count(",")
        scope: dict[str, Any] = {}
        exec(
            compile(f"{lines}def doubled(x):\n    return x + x\n", f"/{folder}/part.py", "exec"), scope
        )
        doubled = named(scope["doubled"], "doubled")
        assert doubled(1.5) == 3.0
        hits.append(sum(doubled.stats.cache_hits.values()))
    assert hits == [0, 1, 0]
