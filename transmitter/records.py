"""What the transmitter writes down."""

from __future__ import annotations

from channel.recording import Field, RecordChannel

TICK_CHANNEL = RecordChannel(
    "tick",
    (
        Field("tick", "integer", "", "index of the tick"),
        Field("time_s", "number", "s", "flight time"),
        Field("measured_rad", "numbers", "rad", "angles as the encoders give them"),
        Field("true_rad", "numbers", "rad", "true angles, where the rig knows them"),
        Field("commanded_volts", "numbers", "V", "command of this tick; null: it had not come"),
        Field("applied_volts", "numbers", "V", "voltages put on the motors"),
        Field("late", "boolean", "", "the command of this tick had not come"),
        Field("lateness_ms", "number", "ms", "how late the tick began", timing=True),
        Field("guard", "string", "", "state of the guard beside the motors"),
    ),
)

ESTIMATE_CHANNEL = RecordChannel(
    "estimate",
    (
        Field("tick", "integer", "", "index of the tick"),
        Field("coded_state", "numbers", "", "codec's model state at that tick"),
        Field("live_state", "numbers", "", "model state that the receiver believed of that tick"),
    ),
)

SAMPLE_CHANNEL = RecordChannel(
    "sample",
    (
        Field("sample", "integer", "", "index of the sample"),
        Field("word_sent", "integers", "", "symbols sent; null: none"),
        Field("word", "integers", "", "symbols as the receiver consumed them; null: erased"),
        Field("range", "numbers", "rad", "range M of each axis before the word"),
        Field("state", "numbers", "", "codec's model state after the sample"),
        Field("coder", "numbers", "", "coder state after the sample"),
        Field("digest", "string", "", "64-bit digest of the codec state after the sample"),
        Field("peer_digest", "string", "", "the receiver's digest of the same sample"),
        Field("lag_samples", "integer", "", "samples sent beyond it when its echo came", timing=True),
    ),
)
