"""The records of the receiver."""

from __future__ import annotations

from collections.abc import Callable

from channel.codec.codec import CodecState, Vector, Word
from channel.codec.lead import FlownSample
from channel.protocol.frames import Symbol
from channel.protocol.recording import AFTER_SAMPLE, ARRIVED_CHANNEL, Field, RecordChannel, Recorder
from channel.protocol.terms import Terms

ReferencesOf = Callable[[int], tuple[float | None, ...]]
"""Tick -> the set-point of each output."""

TICK_CHANNEL = RecordChannel(
    "tick",
    (
        Field("tick", "integer", "", "tick that the command is for"),
        Field("reference", "numbers", "", "set-point of each output; null: it has none"),
        Field("live_state", "numbers", "", "predicted model state of that tick"),
        Field("command", "numbers", "", "command for each input, as on the wire"),
    ),
)

SAMPLE_CHANNEL = RecordChannel(
    "sample",
    (
        Field("sample", "integer", "", "index of the sample"),
        Field("word", "integers", "", "symbols consumed; null: erased"),
        *AFTER_SAMPLE,
        Field("arrival_s", "number", "s", "when the word was decided, on this clock", timing=True),
    ),
)


def write_sample(
    recorder: Recorder,
    terms: Terms,
    word: Word,
    ranges: Vector,
    after: CodecState,
    digest: int,
    now_ns: int,
) -> None:
    """Write one sample down: `ranges` before its word, `after` the state after it."""
    sample = after.sample - 1
    row = (sample, word, ranges, after.model, after.coder, f"{digest:016x}", now_ns / 1e9)
    recorder.write(SAMPLE_CHANNEL, sample * terms.sample_ns, row)


def write_commands(
    recorder: Recorder, terms: Terms, sample: int, flown: FlownSample, references: ReferencesOf
) -> None:
    """Record the commands computed with one sample, and their set-points."""
    tick = sample * terms.ticks_per_sample + terms.lead_ticks
    for predicted, command in zip(flown.live, flown.commands, strict=True):
        row = (tick, references(tick), predicted, command)
        recorder.write(TICK_CHANNEL, tick * terms.tick_ns, row)
        tick += 1


def write_symbol(recorder: Recorder, terms: Terms, symbol: Symbol, now_ns: int, *, taken: bool) -> None:
    """Write down a symbol that came for a slot, in time or for a slot that was settled already."""
    row = (symbol.slot, symbol.number, now_ns, taken)
    recorder.write(ARRIVED_CHANNEL, terms.slot_ns(symbol.slot), row)
