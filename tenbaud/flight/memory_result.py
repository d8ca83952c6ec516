"""The result of a flight in memory: arrays over its ticks and tuples over its samples."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from channel.codec.codec import Model, Word
from channel.protocol.events import Event
from channel.protocol.frames import Desync
from channel.protocol.terms import Terms
from receiver.session.session import ReceiverSession
from tenbaud.recording.memory import MemoryRecorder
from tenbaud.recording.table import Series
from transmitter.session.session import TransmitterSession


@dataclass(frozen=True, slots=True, repr=False, eq=False)
class FlightResult:
    """Everything of one flight. Arrays have a row per tick; NaN where nothing was known of a tick."""

    ticks: int
    """flown"""
    time_s: Series
    """flight time of every tick"""
    angles_rad: Series
    """true angles, a column per measured axis"""
    measured_rad: Series
    """the same as the encoders give them"""
    references: Series
    """set-points of the controller, a column per output"""
    states: Series
    """the codec's estimate, a column per model state"""
    live_states: Series
    """the receiver\'s predicted estimate of the tick when it decided the tick's command"""
    commands: Series
    """motor voltages applied, a column per input"""
    errors: Series
    """true angle less the codec's estimate, a column per measured axis"""
    live_errors: Series
    """true angle less the receiver\'s predicted estimate of it"""
    samples: tuple[int, ...]
    """the samples that were confirmed: both ends hold equal states after them"""
    words: tuple[Word, ...]
    """words that both ends consumed in each of `samples`; None: erased"""
    words_sent: tuple[Word, ...]
    """words that the transmitter sent; None: none"""
    digests: tuple[str, ...]
    """64-bit digest of the state after each of `samples`"""
    counts: Mapping[str, Mapping[str, int]]
    """counts of each end, by `transmitter` and `receiver`"""
    events: tuple[Event, ...]
    """events of the sessions, in order of flight time"""
    desync: Desync | None
    """the last lost lockstep, with both digests; None: there was none"""
    ended_by: str
    """why the flight ended early; empty: it reached its end"""

    @property
    def reference_rad(self) -> Series:
        """The set-point of the first output."""
        return np.asarray(self.references[:, 0], dtype=np.float64)

    @property
    def largest_error_rad(self) -> float:
        """The largest error of the first axis, either way."""
        return float(np.nanmax(np.abs(self.errors[:, 0])))

    def __repr__(self) -> str:
        known = np.isfinite(self.errors).any()
        error = f", error at most {self.largest_error_rad:.4g} rad" if known else ""
        erased = sum(word is None for word in self.words)
        return (
            f"<FlightResult: {self.ticks} ticks, {len(self.samples)} samples in lockstep, "
            f"{erased} erased{error}{f'; ended by: {self.ended_by}' if self.ended_by else ''}>"
        )


def result_of(
    model: Model,
    terms: Terms,
    transmitter: TransmitterSession,
    receiver: ReceiverSession,
    rows: tuple[MemoryRecorder, MemoryRecorder],
    ticks: int,
    ended_by: str,
) -> FlightResult:
    """Return the result of a flight of `ticks` ticks, from the `rows` of transmitter and receiver."""
    up, down = rows
    first = model.measured(model.initial())
    axes, inputs = len(first), model.input_size
    angles = _per_tick(up, "tick", "true", ticks, axes)
    states = _per_tick(up, "estimate", "coded_state", ticks, model.state_size)
    live = _per_tick(up, "estimate", "live_state", ticks, model.state_size)
    events = sorted([*transmitter.events, *receiver.events], key=lambda event: event.time_ns)
    return FlightResult(
        ticks=ticks,
        time_s=np.asarray(np.arange(ticks) * (terms.tick_ns / 1e9), dtype=np.float64),
        angles_rad=angles,
        measured_rad=_per_tick(up, "tick", "measured", ticks, axes),
        references=_per_tick(down, "tick", "reference", ticks, axes),
        states=states,
        live_states=live,
        commands=_per_tick(up, "tick", "applied", ticks, inputs),
        errors=angles - _measured(model, states, axes),
        live_errors=angles - _measured(model, live, axes),
        samples=tuple(up.column("sample", "sample")),
        words=tuple(up.column("sample", "word")),
        words_sent=tuple(up.column("sample", "word_sent")),
        digests=tuple(up.column("sample", "digest")),
        counts={"transmitter": transmitter.counts.copy(), "receiver": receiver.counts.copy()},
        events=tuple(events),
        desync=transmitter.desync,
        ended_by=ended_by,
    )


def _per_tick(rows: MemoryRecorder, topic: str, name: str, ticks: int, width: int) -> Series:
    """Return a recorded field as a row for each tick, NaN where it was not recorded."""
    placed = np.full((ticks, width), np.nan)
    for tick, value in zip(rows.column(topic, "tick"), rows.column(topic, name), strict=True):
        if value is not None and tick < ticks:
            placed[tick] = value
    return placed


def _measured(model: Model, states: Series, axes: int) -> Series:
    """Return the angles that a model reads from each state; NaN from one that is not known."""
    angles = np.full((len(states), axes), np.nan)
    for tick in np.flatnonzero(np.isfinite(states).all(axis=1)):
        angles[tick] = model.measured(tuple(states[tick].tolist()))
    return angles
