"""The records of the transmitter."""

from __future__ import annotations

from channel.codec.codec import Codec
from channel.protocol.recording import AFTER_SAMPLE, WORD, Field, RecordChannel, Recorder
from channel.protocol.terms import Terms
from transmitter.session.copies import Confirmed

TICK_CHANNEL = RecordChannel(
    "tick",
    (
        Field("tick", "integer", "", "index of the tick"),
        Field("time_s", "number", "s", "flight time"),
        Field("measured", "numbers", "", "outputs as the sensors give them"),
        Field("true", "numbers", "", "true outputs, where the rig knows them"),
        Field("commanded", "numbers", "", "command of this tick; null: it had not come"),
        Field("applied", "numbers", "", "inputs that the plant was given"),
        Field("late", "boolean", "", "the command of this tick had not come"),
        Field("lateness_ms", "number", "ms", "how late the tick began", timing=True),
        Field("guard", "string", "", "state of the guard"),
    ),
)

DEVICE_CHANNEL = RecordChannel(
    "device",
    (
        Field("tick", "integer", "", "index of the tick"),
        Field("counts", "integers", "", "of every encoder channel of a real rig"),
        Field("device_s", "number", "s", "the rig's own time since its first sample", timing=True),
        Field("age_ms", "number", "ms", "how long ago the sample had arrived", timing=True),
        Field("lost", "integer", "", "samples missing in the rig's sequence so far", timing=True),
    ),
)


ESTIMATE_CHANNEL = RecordChannel(
    "estimate",
    (
        Field("tick", "integer", "", "index of the tick"),
        Field("coded_state", "numbers", "", "codec's model state at that tick"),
        Field("live_state", "numbers", "", "model state that the receiver predicted for that tick"),
    ),
)

SAMPLE_CHANNEL = RecordChannel(
    "sample",
    (
        Field("sample", "integer", "", "index of the sample"),
        Field("word_sent", "integers", "", "symbols sent; null: none"),
        WORD,
        *AFTER_SAMPLE,
        Field(
            "peer_digest",
            "string",
            "",
            "the receiver's digest of it: the last digits that were sent",
        ),
        Field("lag_samples", "integer", "", "samples beyond it when it was confirmed", timing=True),
        Field("about", "integers", "", "output that each symbol was about, from 0; null: erased"),
    ),
)

CONFIRMED_CHANNEL = RecordChannel(
    "confirmed",
    (
        Field("sample", "integer", "", "index of the sample"),
        WORD,
        Field("symbols", "integers", "", "its down symbols as the receiver sent them"),
        Field("commands", "numbers", "", "commands of its ticks, all inputs of a tick together"),
        Field("doubt", "number", "", "share of other inputs that led to the same state"),
        Field("lag_samples", "integer", "", "samples heard of beyond it when it was confirmed"),
    ),
)

HYPOTHESES_CHANNEL = RecordChannel(
    "hypotheses",
    (
        Field("sample", "integer", "", "the sample whose down symbols were heard"),
        Field("size", "integer", "", "hypotheses that are followed"),
        Field("rest", "number", "", "weight of what is not followed, in units of the list's"),
        Field("best", "number", "", "share of the list that the likeliest one has"),
        Field("confirmed_to", "integer", "", "the first sample that is not certain"),
    ),
)

ASSUMED_CHANNEL = RecordChannel(
    "assumed",
    (
        Field("sample", "integer", "", "a sample that was not certain when what came down fitted none"),
        Field("epoch", "integer", "", "epoch of that sample"),
        Field("word", "integers", "", "symbols that the receiver was assumed to consume; null: erased"),
        Field(
            "symbols", "integers", "", "command symbols that it was assumed to send; null: not known"
        ),
        Field("state", "numbers", "", "this end's model state after the sample"),
        Field("coder", "numbers", "", "this end's coder state after the sample"),
    ),
)


def write_sample(recorder: Recorder, terms: Terms, codec: Codec, done: Confirmed) -> None:
    """Record a confirmed sample, and the estimates of its ticks."""
    first_tick = done.sample * terms.ticks_per_sample
    state = done.flown.state
    # The low ones, up to the first that did not come.
    known_bits = (done.peer_mask ^ (done.peer_mask + 1)).bit_length() - 1
    row = (
        done.sample,
        done.word_sent,
        done.word,
        codec.coder.ranges(done.before.coder),
        state.model,
        state.coder,
        f"{done.digest:016x}",
        f"{done.peer_digest:016x}"[16 - known_bits // 4 :],
        done.lag_samples,
        done.about,
    )
    recorder.write(SAMPLE_CHANNEL, done.sample * terms.sample_ns, row)
    for offset, (coded, live) in enumerate(zip(done.flown.coded, done.live, strict=True)):
        tick = first_tick + offset
        recorder.write(ESTIMATE_CHANNEL, tick * terms.tick_ns, (tick, coded, live))
