"""Set-points from a file."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tenbaud.controllers import Csv

TICK_S = 0.01


def write(folder: Path, text: str) -> Path:
    path = folder / "reference.csv"
    path.write_text(text, encoding="utf-8")
    return path


def test_csv_holds_each_row_until_the_next(tmp_path: Path) -> None:
    path = write(tmp_path, "angle_rad,note,time_s\n0.5,a,0.02\n-1,b,0.29\n\n2.5,c,0.295\n")
    ticks = [0, 1, 2, 28, 29, 30, 10**6]
    assert [Csv(path, TICK_S).value(tick) for tick in ticks] == [0.5, 0.5, 0.5, 0.5, -1.0, 2.5, 2.5]


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        (
            "time_s,height\n0,1\n",
            ": column angle_rad is missing; present: 1 time_s, 2 height",
        ),
        ("time_s,angle_rad\n", ": no rows"),
        ("time_s,angle_rad\n0,1\n1,up\n", ", line 3, column angle_rad: 'up' is not a number"),
        ("time_s,angle_rad\n0,\n", ", line 2, column angle_rad: empty cell"),
        ("time_s,angle_rad\n0,1\n1,inf\n", ", line 3, column angle_rad: 'inf' is not a finite number"),
        ("time_s,angle_rad\n-1,1\n", ", line 2, column time_s: -1.0 found; it must be at least 0"),
        (
            "time_s,angle_rad\n0,1\n2,1\n2,1\n",
            ", line 4, column time_s: 2.0 found; it must be above 2.0",
        ),
    ],
)
def test_csv_errors_name_file_and_line(tmp_path: Path, text: str, fault: str) -> None:
    path = write(tmp_path, text)
    with pytest.raises(ValueError, match=re.escape(f"{path}{fault}")):
        Csv(path, TICK_S)
