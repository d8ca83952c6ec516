"""The tap: rows pass through unchanged, and what nobody takes falls out, oldest first, counted."""

from __future__ import annotations

from collections.abc import Sequence

from channel.protocol.recording import Field, RecordChannel
from tenbaud.telemetry.tap import ROWS_MAX, Tap

TICK = RecordChannel("tick", (Field("tick", "integer"),))
OTHER = RecordChannel("device", (Field("tick", "integer"),))


class Kept:
    def __init__(self) -> None:
        self.rows: list[Sequence[object]] = []

    def write(self, channel: RecordChannel, time_ns: int, row: Sequence[object]) -> None:
        self.rows.append((channel.topic, time_ns, *row))


def test_every_row_reaches_the_recorder_and_the_known_ones_the_telemetry() -> None:
    recorder = Kept()
    tap = Tap(recorder)
    tap.write(TICK, 5, (1,))
    tap.write(OTHER, 6, (2,))
    assert recorder.rows == [("tick", 5, 1), ("device", 6, 2)]
    assert tap.take() == [("tick", (1,))]
    assert tap.take() == []


def test_while_nobody_watches_rows_reach_the_recorder_and_none_is_kept() -> None:
    recorder = Kept()
    tap = Tap(recorder)
    tap.write(TICK, 0, (0,))
    tap.watch(False)
    tap.write(TICK, 1, (1,))
    assert tap.take() == []
    tap.watch(True)
    tap.write(TICK, 2, (2,))
    assert tap.take() == [("tick", (2,))]
    assert recorder.rows == [("tick", 0, 0), ("tick", 1, 1), ("tick", 2, 2)]
    assert tap.dropped == 0


def test_when_nobody_takes_then_the_oldest_rows_are_dropped_and_counted() -> None:
    recorder = Kept()
    tap = Tap(recorder)
    for tick in range(ROWS_MAX + 7):
        tap.write(TICK, tick, (tick,))
    assert len(recorder.rows) == ROWS_MAX + 7
    assert tap.dropped == 7
    rows = tap.take()
    assert (rows[0], rows[-1]) == (("tick", (7,)), ("tick", (ROWS_MAX + 6,)))
