"""`tenbaud figures cliff`: flights near the data-rate theorem, from nothing to picture and tables."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from reproduction import cliff
from reproduction.cliff import QUICK, Point, fly, smallest_rate
from tenbaud.cli.commands import app

FEW = [one for one in QUICK if not 1.1 < one.ratio < 1.9]
"""Without the rates between the smallest one and its double."""


def test_when_the_cliff_is_asked_for_then_picture_points_and_tables_are_there_and_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cliff, "QUICK", FEW)
    done = CliRunner().invoke(app, ["figures", "cliff", "--quick", "--docs", str(tmp_path)])
    assert done.exit_code == 0, done.output
    pictures = tmp_path / "figures"
    assert (pictures / "cliff.png").stat().st_size > 10_000
    assert (pictures / "cliff.svg").read_text().startswith("<?xml")
    kept = (pictures / "cliff.json").read_text()
    points = json.loads(kept)["points"]
    assert len(points) == len(FEW)
    for one in points:
        at_the_limit = one["point"]["rate_bit_s"] == smallest_rate(one["point"]["plant"])
        assert bool(one["found"]["refused"]) == at_the_limit
    page = (tmp_path / "theory" / "cliff.md").read_text()
    assert page.count("refused") == 8
    assert page.count("Rotary pendulum:") == 1

    monkeypatch.setattr(cliff, "fly", None)  # what is kept is not flown again
    assert len(cliff.fly_all(FEW, pictures / "cliff.json", lambda *_: None)) == len(FEW)
    assert (pictures / "cliff.json").read_text() == kept


def test_when_a_pendulum_has_twice_its_smallest_rate_then_all_stay_up_near_the_floor() -> None:
    found = fly(Point("pendulum", 2.0 * smallest_rate("pendulum"), seeds=2, seconds=60.0))
    assert found.up == 2
    assert 1.0 < found.mean < 2.4


def test_when_the_rate_is_the_smallest_one_then_it_is_refused_with_both_numbers() -> None:
    found = fly(Point("furuta", smallest_rate("furuta"), seeds=1, seconds=1.0))
    assert found.up == 0
    assert found.refused.count("22.5") == 2


def test_when_the_same_flights_are_delivered_at_the_end_then_errors_are_larger() -> None:
    start, end = (
        fly(Point("pendulum", 20.0, delivery=delivery, seeds=2, seconds=20.0))
        for delivery in ("start", "end")
    )
    assert end.mean > 1.2 * start.mean


@pytest.mark.soak
@pytest.mark.parametrize(
    ("point", "up"),
    [
        (Point("pendulum", 2.0 * smallest_rate("pendulum"), seeds=6, seconds=60.0), 6),
        (Point("furuta", 2.0 * smallest_rate("furuta"), False, "end", seeds=2, seconds=10.0), 2),
        (Point("furuta", 1.05 * smallest_rate("furuta"), False, "end", seeds=2, seconds=10.0), 0),
    ],
)
def test_when_a_point_is_compiled_then_it_is_found_as_with_the_sessions(point: Point, up: int) -> None:
    found = fly(point, compiled=True)
    assert found.up == up
    assert repr(found) == repr(fly(point, compiled=False))  # NaN included
