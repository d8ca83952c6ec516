"""The records that an audit needs: symbols in slots, and the start of each epoch.

The transmitter writes each symbol with the time at which it left, the receiver each symbol with the
time at which it came. With the start of every epoch, the only states that ever travel (down the link,
at a rejoin), these are all the inputs of the two codecs but the commands, which follow from them.
"""

from __future__ import annotations

from channel.codec.codec import CodecState, Vector
from channel.protocol.recording import Field, RecordChannel

SENT_CHANNEL = RecordChannel(
    "symbol",
    (
        Field("slot", "integer", "", "slot of the symbol, counted from the first one of sample 0"),
        Field("symbol", "integer", "", "number of the symbol in the coder's alphabet"),
        Field("left_ns", "integer", "ns", "flight time at which it left; null: refused", timing=True),
        Field(
            "wire_bytes",
            "integer",
            "",
            "of its frame on this kind of line, framing included",
            timing=True,
        ),
    ),
)

ARRIVED_CHANNEL = RecordChannel(
    "symbol",
    (
        Field("slot", "integer", "", "slot of the symbol, counted from the first one of sample 0"),
        Field("symbol", "integer", "", "number of the symbol in the coder's alphabet"),
        Field("arrived_ns", "integer", "ns", "when it came, on this clock", timing=True),
        Field("taken", "boolean", "", "false: its slot was settled already", timing=True),
    ),
)

EPOCH_CHANNEL = RecordChannel(
    "epoch",
    (
        Field("sample", "integer", "", "first sample of the epoch"),
        Field("epoch", "integer", "", "counted from 0"),
        Field("state", "numbers", "", "model state that the epoch starts from"),
        Field("coder", "numbers", "", "coder state that it starts from"),
        Field("hold_volts", "numbers", "V", "command of its first ticks, until one is decided"),
    ),
)


def epoch_row(epoch: int, start: CodecState, hold: Vector) -> tuple[object, ...]:
    """Return the row of `EPOCH_CHANNEL` for the beginning of an epoch."""
    return (start.sample, epoch, start.model, start.coder, hold)
