"""Descriptions of a node's records: a recording stores their names and units.

A node declares its channels as `RecordChannel`s and hands rows to a `Recorder`. It never learns
where they go: the tool puts them into a file from another thread, a test into a list.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, Protocol

from channel.codec.codec import CodecState, Vector

FieldType = Literal["number", "integer", "string", "boolean", "numbers", "integers"]
"""JSON types; the plural ones are arrays. Any field may also be null (None)."""


@dataclass(frozen=True, slots=True)
class Field:
    """One column of a recorded channel."""

    name: str
    type: FieldType
    unit: str = ""
    description: str = ""
    timing: bool = False
    """True for wall-clock readings and what depends on the kind of line: two runs of one flight need
    not share them."""


@dataclass(frozen=True, slots=True)
class RecordChannel:
    """A named stream of rows. By convention the first field is the tick or sample that a row is of."""

    topic: str
    fields: tuple[Field, ...]


class Recorder(Protocol):
    """Takes rows without ever waiting: a full queue drops the row and counts it."""

    def write(self, channel: RecordChannel, time_ns: int, row: Sequence[object]) -> None:
        """Keep one row, its values in the order of `channel.fields`.

        `time_ns` is the flight's time (zero at tick 0), in nanoseconds.
        """


class NullRecorder:
    """Keeps nothing: for flights flown without a recording."""

    def write(self, channel: RecordChannel, time_ns: int, row: Sequence[object]) -> None:
        """Forget the row."""


def _sent(topic: str, slot: Field, symbol: Field) -> RecordChannel:
    """Return the channel of the symbols that one end sent."""
    left = Field("left_ns", "integer", "ns", "flight time at which it left; null: refused", timing=True)
    size = Field(
        "wire_bytes", "integer", "", "of its frame on this kind of line, framing included", timing=True
    )
    return RecordChannel(topic, (slot, symbol, left, size))


def _arrived(topic: str, slot: Field, symbol: Field) -> RecordChannel:
    """Return the channel of the symbols that came to one end."""
    came = Field("arrived_ns", "integer", "ns", "when it came, on this clock", timing=True)
    taken = Field("taken", "boolean", "", "false: its slot was settled already", timing=True)
    return RecordChannel(topic, (slot, symbol, came, taken))


_UP = (
    Field("slot", "integer", "", "slot of the symbol, counted from the first one of sample 0"),
    Field("symbol", "integer", "", "number of the symbol in the coder's alphabet"),
)
_DOWN = (
    Field("slot", "integer", "", "slot of the down symbol, counted from the first one of sample 0"),
    Field("symbol", "integer", "", "0 or 1"),
)
SENT_CHANNEL = _sent("symbol", *_UP)
ARRIVED_CHANNEL = _arrived("symbol", *_UP)
DOWN_SENT_CHANNEL = _sent("down_symbol", *_DOWN)

WORD = Field("word", "integers", "", "symbols as the receiver consumed them; null: erased")
AFTER_SAMPLE = (
    Field("range", "numbers", "", "range M of each output before the word"),
    Field("state", "numbers", "", "codec's model state after the sample"),
    Field("coder", "numbers", "", "coder state after the sample"),
    Field("digest", "string", "", "64-bit digest of the codec state after the sample"),
)

EPOCH_CHANNEL = RecordChannel(
    "epoch",
    (
        Field("sample", "integer", "", "first sample of the epoch"),
        Field("epoch", "integer", "", "counted from 0"),
        Field("state", "numbers", "", "model state that the epoch starts from"),
        Field("coder", "numbers", "", "coder state that it starts from"),
        Field("hold", "numbers", "", "command of its first ticks, until one is decided"),
    ),
)

TWO_WAY_CHANNEL = RecordChannel(
    "two_way",
    (
        Field("sample", "integer", "", "first sample of the epoch"),
        Field("epoch", "integer", "", "counted from 0"),
        Field("state", "string", "", "state of the two-way machine, its canonical bytes as hex"),
    ),
)

DOWN_SYMBOLS_CHANNEL = RecordChannel(
    "down_symbols",
    (
        Field("sample", "integer", "", "index of the sample"),
        Field("symbols", "integers", "", "its down symbols in the order of their slots; null: erased"),
    ),
)


def write_two_way(recorder: Recorder, sample_ns: int, sample: int, epoch: int, packed: bytes) -> None:
    """Record the packed state of the two-way machine that an epoch starts from."""
    recorder.write(TWO_WAY_CHANNEL, sample * sample_ns, (sample, epoch, packed.hex()))


def write_down_symbols(
    recorder: Recorder, sample_ns: int, sample: int, symbols: Sequence[int | None]
) -> None:
    """Record the down symbols of a sample, as they were sent or as they came."""
    recorder.write(DOWN_SYMBOLS_CHANNEL, sample * sample_ns, (sample, symbols))


def write_epoch(
    recorder: Recorder, sample_ns: int, epoch: int, start: CodecState, hold: Vector
) -> None:
    """Record the start state of an epoch."""
    row = (start.sample, epoch, start.model, start.coder, hold)
    recorder.write(EPOCH_CHANNEL, start.sample * sample_ns, row)
