"""What a long flight takes at its end, in memory."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from channel.codec.models.pitch import PITCH_SIGNALS
from tenbaud.recording.overview import OverviewRecorder
from tenbaud.recording.reader import stored_metadata
from tenbaud.recording.writer import McapRecorder
from tests.tenbaud.processes import REPOSITORY
from tests.tenbaud.recording.long import long_recording, pitch_rad
from transmitter.session.records import ESTIMATE_CHANNEL, TICK_CHANNEL

MEMORY_MAX_MIB = 150
PROGRAM = """
import json, resource, sys
from pathlib import Path
from tenbaud.flight.report import draw_figure
from tenbaud.recording.folder import RunFolder
from tenbaud.recording.inspect import describe_text

def peak():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024

before = peak()
describe_text(Path(sys.argv[1]))
inspected = peak()
problem = draw_figure(RunFolder(Path(sys.argv[1])), "a flight")
print(json.dumps({"inspect": inspected - before, "figure": peak() - before, "problem": problem}))
"""


# As objects the rows of the shortest would take more than the memory that is allowed.
@pytest.mark.parametrize(
    "ticks",
    [100_000, *(pytest.param(ticks, marks=pytest.mark.soak) for ticks in (1_000_000, 10_000_000))],
)
def test_a_long_recording_is_inspected_and_drawn_in_bounded_memory(tmp_path: Path, ticks: int) -> None:
    """From its rows, which takes more than what a recorder has stored for the figure."""
    long_recording(tmp_path / "transmitter.mcap", ticks)
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, str(tmp_path)],
        cwd=REPOSITORY,
        capture_output=True,
        text=True,
        check=True,
    )
    told = json.loads(done.stdout)
    assert told["problem"] is None
    assert told["inspect"] < 30
    assert told["figure"] < MEMORY_MAX_MIB
    assert (tmp_path / "flight.png").read_bytes().startswith(b"\x89PNG")


def test_the_stored_overview_of_a_long_flight_is_that_of_its_rows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import numpy as np

    from tenbaud.recording import figure, overview

    monkeypatch.setattr(overview, "ROWS_OF_LONG_FLIGHT", 50_000)
    path = tmp_path / "transmitter.mcap"
    with McapRecorder(
        path, {}, wait_when_full=True, overview=OverviewRecorder(PITCH_SIGNALS)
    ) as recorder:
        for tick in range(40_000):
            time_ns, pitch = tick * 10_000_000, pitch_rad(tick)
            row = (tick, tick * 0.01, (pitch,), None, None, (0.0, 0.0), False, 0.1, "running")
            recorder.write(TICK_CHANNEL, time_ns, row)
            recorder.write(ESTIMATE_CHANNEL, time_ns, (tick, (pitch + 0.1, 0.0), (pitch + 0.2, 0.0)))
    assert "overview" in stored_metadata(path, ("overview",))
    stored, _ = figure._read_overview(path, own=True)
    read, _ = figure._read_overview(path, own=False)
    for name, curve in read.held().items():
        for one, other in zip(stored.held()[name].curve(), curve.curve(), strict=True):
            np.testing.assert_array_equal(one, other, err_msg=name)
    assert len(read.curves["value"][0].curve()[0]) > 2000
