from __future__ import annotations

import errno
import os
import signal
import subprocess
import sys
import threading
import tracemalloc
from pathlib import Path

import pytest

from channel.protocol.recording import Field, RecordChannel
from tenbaud.files.whole import WriteError
from tenbaud.recording.chunk_writer import ChunkWriter
from tenbaud.recording.errors import RecordingError
from tenbaud.recording.reader import MessageStream, Recording
from tenbaud.recording.writer import REAL_TIME_BATCH_ROWS, McapRecorder
from tests.tenbaud.recording.rows import SAMPLE, TICK, sample_row, tick_row

AWKWARD_FLOATS = [0.1, 1 / 3, -0.0, 5e-324, 1.7976931348623157e308, 1e22, 2**53 + 2.0, 1e-7]
KILLED_PROGRAM = """
import sys, time
from pathlib import Path
from channel.protocol.recording import Field, RecordChannel
from tenbaud.recording.writer import McapRecorder

channel = RecordChannel("tick", (Field("tick", "integer"),))
recorder = McapRecorder(Path(sys.argv[1]), {})
start_s = time.monotonic()
tick, marked = 0, None
while True:
    recorder.write(channel, tick, (tick,))
    if marked is None and time.monotonic() - start_s >= 0.5:
        marked, marked_s = tick, time.monotonic()
    if marked is not None and time.monotonic() - marked_s >= 1.2:
        print(marked, flush=True)
        marked_s = float("inf")
    tick += 1
    time.sleep(0.005)
"""


@pytest.fixture
def still(monkeypatch: pytest.MonkeyPatch) -> threading.Event:
    """Keep the recorder's thread from draining until the event is set."""
    gate = threading.Event()
    drain = McapRecorder._drain

    def wait_then_drain(recorder: McapRecorder) -> None:
        gate.wait(30.0)
        drain(recorder)

    monkeypatch.setattr(McapRecorder, "_drain", wait_then_drain)
    return gate


def test_floats_come_back_with_every_bit(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    with McapRecorder(path, {}) as recorder:
        for tick, value in enumerate(AWKWARD_FLOATS):
            recorder.write(TICK, tick, (tick, AWKWARD_FLOATS, None, True, value, 'odd "text" \n é'))
    rows = [row for _, row in Recording(path).rows("tick")]
    assert [row["lateness_ms"].hex() for row in rows] == [value.hex() for value in AWKWARD_FLOATS]
    for row in rows:
        assert [value.hex() for value in row["measured"]] == [v.hex() for v in AWKWARD_FLOATS]
        assert (row["true"], row["late"], row["guard"]) == (None, True, 'odd "text" \n é')


def test_what_is_not_finite_becomes_null(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    nan, infinity = float("nan"), float("inf")
    with McapRecorder(path, {}) as recorder:
        recorder.write(TICK, 0, (0, [nan, 1.0, -infinity], [], False, infinity, ""))
    [(_, row)] = Recording(path).rows("tick")
    assert (row["measured"], row["true"]) == ([None, 1.0, None], [])
    assert row["lateness_ms"] is None


def test_channel_comes_back_with_types_units_and_meanings(tmp_path: Path) -> None:
    percent = RecordChannel("odd %s", (Field("share_%", "number", "%", 'per "cent"'),))
    path = tmp_path / "a.mcap"
    with McapRecorder(path, {"seed": "7"}) as recorder:
        recorder.write(TICK, 3, tick_row(0, 0.5))
        recorder.write(SAMPLE, 4, sample_row(0, word=None, state=0.5))
        recorder.write(percent, 5, (12.5,))
    recording = Recording(path)
    assert recording.metadata == {"seed": "7"}
    assert [topic.channel for topic in recording.topics.values()] == [TICK, SAMPLE, percent]
    assert [row for _, row in recording.rows("odd %s")] == [{"share_%": 12.5}]
    with pytest.raises(RecordingError, match=r"no topic 'tock'.*tick, sample"):
        recording.topic("tock")


def test_full_queue_drops_the_newest_and_counts(tmp_path: Path, still: threading.Event) -> None:
    path = tmp_path / "a.mcap"
    recorder = McapRecorder(path, {}, queue_limit=100)
    for tick in range(130):
        recorder.write(TICK, tick, tick_row(tick, 0.0))
    assert recorder.rows_dropped == 30
    still.set()
    recorder.close()
    assert (recorder.rows_written, recorder.rows_dropped) == (100, 30)
    recording = Recording(path)
    assert [row["tick"] for _, row in recording.rows("tick")] == list(range(100))
    assert recording.metadata_record("recorder")["rows_dropped"] == "30"


def test_flight_in_virtual_time_waits_instead_of_losing_rows(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    with McapRecorder(path, {}, queue_limit=50, wait_when_full=True) as recorder:
        for tick in range(1000):
            recorder.write(TICK, tick, tick_row(tick, 0.0))
    assert (recorder.rows_written, recorder.rows_dropped) == (1000, 0)
    recorder.write(TICK, 1000, tick_row(1000, 0.0))
    assert recorder.rows_dropped == 1


def test_rows_after_close_are_counted_and_close_may_be_repeated(tmp_path: Path) -> None:
    recorder = McapRecorder(tmp_path / "a.mcap", {})
    recorder.write(TICK, 0, tick_row(0, 0.0))
    recorder.close()
    size_bytes = recorder.path.stat().st_size
    recorder.write(TICK, 1, tick_row(1, 0.0))
    recorder.close()
    assert (recorder.rows_written, recorder.rows_dropped) == (1, 1)
    assert recorder.path.stat().st_size == size_bytes
    assert MessageStream(recorder.path).path == recorder.path


def test_row_that_cannot_be_encoded_is_lost_alone(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    with McapRecorder(path, {}) as recorder:
        recorder.write(TICK, 0, tick_row(0, 0.0))
        recorder.write(TICK, 1, (1, [0.0]))
        recorder.write(TICK, 2, (2, [object()], None, False, 0.0, ""))
        recorder.write(TICK, 3, tick_row(3, 0.0))
    assert (recorder.rows_written, recorder.rows_dropped) == (2, 2)
    assert recorder.error is not None
    assert "'tick' could not be recorded" in recorder.error
    assert [row["tick"] for _, row in Recording(path).rows("tick")] == [0, 3]


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs the device that is always full")
def test_flight_goes_on_when_the_disk_is_full_from_the_start() -> None:
    with McapRecorder(Path("/dev/full"), {}) as recorder:
        for tick in range(5000):
            recorder.write(TICK, tick, tick_row(tick, 0.0))
    assert (recorder.rows_written, recorder.rows_dropped) == (0, 5000)
    assert recorder.error is not None
    assert os.strerror(errno.ENOSPC) in recorder.error


def test_disk_that_fills_up_leaves_what_was_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, still: threading.Event
) -> None:
    path = tmp_path / "a.mcap"
    calls = 0
    flush = ChunkWriter.flush

    def flush_until_full(writer: ChunkWriter) -> None:
        nonlocal calls
        calls += 1
        if calls > 4:  # the head and three batches
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        flush(writer)

    monkeypatch.setattr(ChunkWriter, "flush", flush_until_full)
    monkeypatch.setattr("tenbaud.recording.writer.FLUSH_PERIOD_S", 0.0)
    recorder = McapRecorder(path, {})
    for tick in range(2000):
        recorder.write(TICK, tick, tick_row(tick, 0.0))
    still.set()
    recorder.close()
    kept = 3 * REAL_TIME_BATCH_ROWS
    assert (recorder.rows_written, recorder.rows_dropped) == (kept, 2000 - kept)
    assert recorder.error is not None
    assert "The flight goes on" in recorder.error
    stream = MessageStream(path)
    assert [row["tick"] for _, _, row in stream] == list(range(kept))
    assert not stream.complete


def test_killed_process_loses_at_most_the_last_second(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    with subprocess.Popen(
        [sys.executable, "-c", KILLED_PROGRAM, str(path)], stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        marked = int(process.stdout.readline())
        process.send_signal(getattr(signal, "SIGKILL", signal.SIGTERM))
    stream = MessageStream(path)
    ticks = [row["tick"] for _, _, row in stream]
    assert not stream.complete
    assert ticks == list(range(len(ticks)))
    assert marked in ticks


def test_existing_recording_is_never_overwritten(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    path.write_bytes(b"precious")
    with pytest.raises(RecordingError, match="not overwritten"):
        McapRecorder(path, {})
    assert path.read_bytes() == b"precious"
    with pytest.raises(WriteError, match="cannot be written"):
        McapRecorder(tmp_path / "nowhere" / "a.mcap", {})


def test_long_recording_keeps_no_row_in_memory(tmp_path: Path, still: threading.Event) -> None:
    """The mcap package keeps one index entry per chunk until the end, and nothing per row."""
    rows = 10_000
    recorder = McapRecorder(tmp_path / "a.mcap", {})
    held_bytes = []
    tracemalloc.start()
    for _ in range(2):
        for tick in range(rows):
            recorder.write(TICK, tick, tick_row(tick, tick / 3))
        while recorder._queue:
            recorder._write_batch()
        recorder._flush()
        held_bytes.append(tracemalloc.get_traced_memory()[0])
    tracemalloc.stop()
    still.set()
    recorder.close()
    assert recorder.rows_written == 2 * rows
    assert held_bytes[1] - held_bytes[0] < 10 * rows
