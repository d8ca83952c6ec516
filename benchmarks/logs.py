"""A recorded log of 24 hours at 100 Hz: the memory that it takes to be read, and to be replayed."""

from __future__ import annotations

import math
import subprocess
import sys
import tempfile
from pathlib import Path

from benchmarks.figures import Figure

ROWS = 24 * 3600 * 100
ROWS_AT_ONCE = 100_000
REPLAY = """
import json, resource, sys, time
from tenbaud.build.flight_log import read_flight_log
from tenbaud.build.recorded import flight_config
from tenbaud.studies.flights import CompiledPoint

def peak_mb():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / 1e6

settings = {
    "transmitter": {"rig": "replay"},
    "receiver": {"controller": "recorded"},
    "flight_log": {"file": sys.argv[1]},
}
started = time.perf_counter()
config = flight_config(None, None, settings)
assert len(read_flight_log(config)) == int(sys.argv[2])
read = [time.perf_counter() - started, peak_mb()]
flown = CompiledPoint(config).fly(1)[0]
assert flown.outcome == "ok"
print(json.dumps([*read, time.perf_counter() - started - read[0], peak_mb()]))
"""


def log_figures(rows: int = ROWS) -> list[Figure]:
    """Write a log, read and replay it in another process; return what that takes."""
    with tempfile.TemporaryDirectory() as name:
        file = Path(name) / "day.csv"
        _write(file, rows)
        done = subprocess.run(
            [sys.executable, "-c", REPLAY, str(file), str(rows)],
            cwd=Path(__file__).parents[1],
            capture_output=True,
            text=True,
            check=True,
        )
    read_s, read_mb, flown_s, flown_mb = map(float, done.stdout.strip("[]\n").split(","))
    return [
        Figure("day_log_read_s", read_s, "s", ""),
        Figure("day_log_read_mb", read_mb, "MB", "below 2000"),
        Figure("day_log_replay_s", flown_s, "s", ""),
        Figure("day_log_replay_mb", flown_mb, "MB", "below 2000"),
    ]


def _write(path: Path, rows: int) -> None:
    with path.open("w") as stream:
        stream.write("time,angle,u1,u2\n")
        for first in range(0, rows, ROWS_AT_ONCE):
            stream.writelines(
                f"{at * 0.01:.2f},{0.5 * math.sin(0.007 * at):.5f},{1 - at // 200 % 2 * 2},0\n"
                for at in range(first, min(rows, first + ROWS_AT_ONCE))
            )
