"""Files written as the nodes write them."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from channel.protocol.recording import RecordChannel
from tenbaud.recording.folder import RECEIVER_NAME, TRANSMITTER_NAME
from tenbaud.recording.writer import McapRecorder
from tests.tenbaud.recording.rows import (
    ESTIMATE,
    EVENT,
    RECEIVER_SAMPLE,
    RECEIVER_TICK,
    SAMPLE,
    TICK,
    Rows,
    tick_row,
)


@pytest.fixture
def record() -> Callable[[Path, Rows], Path]:
    def write(path: Path, rows: Rows) -> Path:
        path.parent.mkdir(parents=True, exist_ok=True)
        with McapRecorder(path, {"role": path.stem, "seed": "7"}) as recorder:
            for channel, time_ns, row in rows:
                recorder.write(channel, time_ns, row)
        assert recorder.error is None
        assert recorder.rows_written == len(rows)
        return path

    return write


@pytest.fixture
def fly(record: Callable[[Path, Rows], Path]) -> Callable[..., Path]:
    """Write the folder of a plausible flight of a 100 Hz loop over 10 bit/s."""

    def write(folder: Path, ticks: int = 600, erased: tuple[int, ...] = ()) -> Path:
        transmitter: list[tuple[RecordChannel, int, Sequence[object]]] = []
        receiver: list[tuple[RecordChannel, int, Sequence[object]]] = []
        for tick in range(ticks):
            time_ns = tick * 10_000_000
            time_s = tick * 0.01
            reference_rad = 0.3 * math.sin(0.5 * time_s)
            pitch_rad = 0.27 * math.sin(0.5 * time_s - 0.2) + 0.01 * math.sin(3.1 * time_s)
            coded_rad = pitch_rad + 0.02 * math.sin(9.0 * time_s) * math.exp(-0.05 * time_s)
            live_rad = coded_rad + 0.008 * math.sin(14.0 * time_s)
            transmitter.append((TICK, time_ns, tick_row(tick, pitch_rad)))
            states = ([coded_rad, 0.0], [live_rad, 0.0])
            transmitter.append((ESTIMATE, time_ns, (tick, *states)))
            receiver.append((RECEIVER_TICK, time_ns, (tick, [reference_rad])))
            if tick % 10 == 0:
                sample = tick // 10
                word = None if sample in erased else [1 if coded_rad < pitch_rad else -1]
                range_rad = [0.02 + 0.13 * math.exp(-0.3 * time_s)]
                row = (sample, word, range_rad, [coded_rad, 0.0], f"{sample:016x}")
                transmitter.append((SAMPLE, time_ns, row))
                receiver.append((RECEIVER_SAMPLE, time_ns, (*row, time_s)))
        transmitter.append((EVENT, 0, (0.0, "start", None, "the first symbol")))
        record(folder / TRANSMITTER_NAME, transmitter)
        record(folder / RECEIVER_NAME, receiver)
        return folder

    return write
