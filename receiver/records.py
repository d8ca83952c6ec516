"""What the receiver writes down."""

from __future__ import annotations

from channel.recording import Field, RecordChannel

TICK_CHANNEL = RecordChannel(
    "tick",
    (
        Field("tick", "integer", "", "tick that the command is for"),
        Field("reference_rad", "number", "rad", "set-point of the controller at that tick"),
        Field("live_state", "numbers", "", "model state believed, in advance, of that tick"),
        Field("command_volts", "numbers", "V", "motor voltages commanded, as on the wire"),
    ),
)

SAMPLE_CHANNEL = RecordChannel(
    "sample",
    (
        Field("sample", "integer", "", "index of the sample"),
        Field("word", "integers", "", "symbols consumed; null: erased"),
        Field("range", "numbers", "rad", "range M of each axis before the word"),
        Field("state", "numbers", "", "codec's model state after the sample"),
        Field("coder", "numbers", "", "coder state after the sample"),
        Field("digest", "string", "", "64-bit digest of the codec state after the sample"),
        Field("arrival_s", "number", "s", "when the word was decided, on this clock", timing=True),
    ),
)
