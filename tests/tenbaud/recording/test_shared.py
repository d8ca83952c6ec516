"""One thread that writes many recordings."""

from __future__ import annotations

from pathlib import Path

from channel.protocol.recording import Field, RecordChannel
from tenbaud.recording.reader import Recording
from tenbaud.recording.shared import SharedWriter
from tenbaud.recording.writer import McapRecorder

CHANNEL = RecordChannel("tick", (Field("tick", "integer"),))
ROWS = 500


def test_when_recorders_share_a_thread_then_each_file_has_its_own_rows(tmp_path: Path) -> None:
    writer = SharedWriter()
    paths = [tmp_path / f"{index}.mcap" for index in range(5)]
    recorders = [McapRecorder(path, {}, shared=writer) for path in paths]
    for tick in range(ROWS):
        for index, recorder in enumerate(recorders):
            recorder.write(CHANNEL, tick, (tick * 10 + index,))
    for recorder in recorders:
        recorder.finish_soon()
    for recorder in recorders:
        recorder.close()
        assert (recorder.rows_written, recorder.rows_dropped, recorder.error) == (ROWS, 0, None)
    writer.close()
    for index, path in enumerate(paths):
        ticks = [row["tick"] for _, row in Recording(path).rows("tick")]
        assert ticks == [tick * 10 + index for tick in range(ROWS)]
