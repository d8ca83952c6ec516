"""What a long recording takes in memory, read and replayed."""

from __future__ import annotations

import tracemalloc
from pathlib import Path

from tenbaud.build.recorded import flight_config
from tenbaud.studies.flights import CompiledPoint

DAY_ROWS = 24 * 3600 * 100
DAY_BYTES = 1.6e9
"""For the rows of a day at 100 Hz; Python and the libraries take the rest of 2 GB."""
SHORT, LONG = 5_000, 60_000


def test_a_day_at_100_hz_is_read_and_replayed_in_two_gigabytes(tmp_path: Path) -> None:
    files = [log_of(tmp_path, rows) for rows in (1000, SHORT, LONG)]
    fly(files[0])  # compiles
    peaks = []
    for file in files[1:]:
        tracemalloc.start()
        fly(file)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    bytes_per_row = (peaks[1] - peaks[0]) / (LONG - SHORT)
    # What is measured and commanded is kept, and what was estimated of it: the trace sees the arrays.
    assert 40.0 < bytes_per_row < DAY_BYTES / DAY_ROWS


def log_of(folder: Path, rows: int) -> Path:
    file = folder / f"{rows}.csv"
    lines = [f"{at * 0.01:.2f},{at % 700 * 0.001:.3f},{at % 3},0" for at in range(rows)]
    file.write_text("\n".join(["time,angle,u1,u2", *lines]) + "\n")
    return file


def fly(file: Path) -> None:
    settings = {
        "transmitter": {"rig": "replay"},
        "receiver": {"controller": "recorded"},
        "flight_log": {"file": str(file)},
    }
    figures, _ = CompiledPoint(flight_config(None, None, settings)).fly(1)
    assert figures.outcome == "ok"
    assert figures.samples > 0
