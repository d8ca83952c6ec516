"""docs/THREE-AXES.md: its figures are as good as was aimed for, and its command makes them anew."""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path

import pytest

from channel.codec.coders.direction import DirectionCoder
from reproduction.axes import alone, page
from tests.rules.sources import TOP

PAGE = (TOP / "docs" / "THREE-AXES.md").read_text(encoding="utf-8")
AIMS = {"unequal": (1.8, 1.95), "equal": (1.75, 1.8)}
"""rms over the joint floor, the strength of the disturbance known and unknown"""
DEGREES = (0.08, 0.08, 0.19)


def table(name: str) -> list[list[str]]:
    """Return the rows of a table of the page, without its head."""
    found = re.search(rf"<!-- table: {name} -->\n(.*?)<!-- end -->", PAGE, re.DOTALL)
    assert found
    lines = found[1].splitlines()[2:]
    assert lines, f"the table {name} is empty"
    return [[cell.strip(" *") for cell in line.strip("|").split("|")] for line in lines]


def test_the_coder_alone_is_as_near_to_the_joint_floor_as_aimed_for() -> None:
    rows = table("ratios")
    assert len(rows) == 6
    for densities, rate, known, unknown, _, *degrees in rows:
        for found, most in zip((known, unknown), AIMS[densities], strict=True):
            assert float(found.split()[0]) <= most, (densities, rate)
        if (densities, rate) == ("unequal", "10"):
            for one, most_deg in zip(degrees, DEGREES, strict=True):
                assert float(one.rstrip("°")) <= most_deg


def test_boxes_are_tracked_like_by_the_usual_loop_and_fixed_coders_are_twice_as_far_off() -> None:
    rows = {row[0].strip("`"): row for row in table("boxes")}
    assert all(float(one) <= 1.05 for one in rows["helicopter-10baud"][4].split(","))
    assert float(table("fixed")[-1][1].split()[0]) <= 0.5


def test_the_figures_come_of_the_coder_s_own_functions(monkeypatch: pytest.MonkeyPatch) -> None:
    encode, decode, _ = DirectionCoder.functions
    monkeypatch.setattr(alone, "_flown", lambda: partial(alone.error_products, encode, decode))
    monkeypatch.setattr(alone, "SETTLING", 50)
    row = alone.row_of("unequal", 10.0, 1, 450)
    assert 1.3 < row.known.value < 2.2
    assert 1.3 < row.unknown.value < 2.5
    assert row.degrees[2] == pytest.approx(0.178, rel=0.3)
    assert row.least_degrees == pytest.approx(0.1185, abs=1e-3)


@pytest.mark.soak
def test_the_command_fills_every_table(tmp_path: Path) -> None:
    made = page.make_page(tmp_path, page.Scale(2, 1500, 12.0, 12.0), lambda share, part: None)
    text = made.read_text(encoding="utf-8")
    assert re.sub(r"<!-- table.*?end -->", "", text, flags=re.DOTALL) == re.sub(
        r"<!-- table.*?end -->", "", PAGE, flags=re.DOTALL
    )
    assert (tmp_path / "figures" / "three-axes.png").stat().st_size > 10_000
    assert text.count("| `helicopter-") == len(page.PRESETS)
