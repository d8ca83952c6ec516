"""Small channels of the shape that the nodes record, and rows for them."""

from __future__ import annotations

from collections.abc import Sequence

from channel.protocol.recording import Field, RecordChannel

TICK = RecordChannel(
    "tick",
    (
        Field("tick", "integer", "", "index of the tick"),
        Field("measured", "numbers", "rad", "what the encoder read"),
        Field("true", "numbers", "rad"),
        Field("late", "boolean"),
        Field("lateness_ms", "number", "ms", "after the due time", timing=True),
        Field("guard", "string"),
    ),
)
ESTIMATE = RecordChannel(
    "estimate",
    (
        Field("tick", "integer"),
        Field("coded_state", "numbers", "rad, rad/s"),
        Field("live_state", "numbers", "rad, rad/s"),
    ),
)
SAMPLE = RecordChannel(
    "sample",
    (
        Field("sample", "integer"),
        Field("word", "integers"),
        Field("range", "numbers", "rad"),
        Field("state", "numbers"),
        Field("digest", "string"),
    ),
)
RECEIVER_TICK = RecordChannel("tick", (Field("tick", "integer"), Field("reference", "numbers")))
RECEIVER_SAMPLE = RecordChannel(
    "sample",
    (*SAMPLE.fields, Field("arrival_s", "number", "s", "on the receiver's clock", timing=True)),
)
EVENT = RecordChannel(
    "event",
    (
        Field("time_s", "number", "s"),
        Field("kind", "string"),
        Field("sample", "integer"),
        Field("text", "string"),
    ),
)

Rows = Sequence[tuple[RecordChannel, int, Sequence[object]]]


def tick_row(tick: int, angle_rad: float, lateness_ms: float = 0.1) -> tuple[object, ...]:
    return (tick, [angle_rad], None, False, lateness_ms, "armed")


def sample_row(sample: int, *, word: list[int] | None, state: float) -> tuple[object, ...]:
    return (sample, word, [0.1], [state, 0.0], f"{sample:016x}")
