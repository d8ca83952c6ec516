"""The signals of a flight by name, on one time base: the ticks.

What was recorded per tick stands at its tick; what was recorded per sample is held over the sample's
ticks. Where nothing was recorded there is NaN. Names and units are those of the plant.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from channel.codec.signals import Signals, unit_row, unit_suffix
from tenbaud.recording.reader import Recording
from tenbaud.recording.table import Series, Table


@dataclass(frozen=True, slots=True)
class Signal:
    """One signal or column: float64 values (NaN where there is none), whole numbers, or texts."""

    name: str
    values: NDArray[Any]
    unit: str = ""
    description: str = ""

    @property
    def is_text(self) -> bool:
        return self.values.dtype == object

    @property
    def column(self) -> str:
        """The name with its unit, for a file that has no other place for it: `pitch_rad`."""
        unit = unit_suffix(self.unit)
        return f"{self.name}_{unit}" if unit and not self.name.endswith(f"_{unit}") else self.name


@dataclass(frozen=True, slots=True)
class TimeBase:
    """The ticks of a run, without gaps, and how samples lie on them."""

    ticks: np.ndarray[tuple[int], np.dtype[np.int64]]
    tick_s: float
    ticks_per_sample: int

    def place(self, table: Table, values: Series) -> Series:
        """Return per-tick values of a table (its first column is the tick) on this base."""
        return _scattered(table.keys, values, int(self.ticks[0]), len(self.ticks))

    def hold(self, table: Table, values: Series) -> Series:
        """Return per-sample values of a table, held over the ticks of each sample."""
        first = int(self.ticks[0]) // self.ticks_per_sample
        count = int(self.ticks[-1]) // self.ticks_per_sample - first + 1
        held = _scattered(table.keys, values, first, count)
        kept: Series = held[self.ticks // self.ticks_per_sample - first]
        return kept

    def symbols(self, table: Table, words: Series) -> Series:
        """Return the words of a table (a column per symbol) symbol by symbol, each over its slot."""
        if words.shape[1] == 0:
            return np.full(len(self.ticks), np.nan)
        slots = self.ticks % self.ticks_per_sample * words.shape[1] // self.ticks_per_sample
        each = [self.hold(table, words[:, place]) for place in range(words.shape[1])]
        chosen: Series = np.choose(slots, each)
        return chosen


def _scattered(keys: NDArray[np.int64], values: Series, first: int, count: int) -> Series:
    placed = np.full(count, np.nan)
    at = keys - first
    inside = (at >= 0) & (at < count)
    placed[at[inside]] = values[inside]
    return placed


Row = Sequence[float]
"""coefficients of the states that make an output"""


def summed(row: Row, state: Callable[[int], Series | None]) -> Series | None:
    """Return the sum of states by their coefficients; None for no coefficient, or without a state."""
    total: Series | None = None
    for place, share in enumerate(row):
        if share:
            values = state(place)
            if values is None:
                return None
            total = share * values if total is None else total + share * values
    return total


Maker = Callable[["Source"], Series | None]


@dataclass(frozen=True, slots=True)
class Source:
    """The sources of signals. An end that was not recorded is None."""

    base: TimeBase
    transmitter: Recording | None
    receiver: Recording | None

    def ticks(self, end: str, topic: str, name: str, axis: int | None) -> Series | None:
        """Return a per-tick field on the time base; None where it was not recorded."""
        found = self._column(end, topic, name, axis)
        return None if found is None else self.base.place(*found)

    def output(self, place: int) -> Series | None:
        """Return the true value of an output where the rig knows it, else the measured one."""
        true = self.ticks("transmitter", "tick", "true", place)
        measured = self.ticks("transmitter", "tick", "measured", place)
        if true is None or measured is None:
            return measured if true is None else true
        return np.where(np.isnan(true), measured, true)

    def coded(self, row: Row) -> Series | None:
        """Return the codec's estimate of a sum of states; None for another output."""
        return summed(row, partial(self.ticks, "transmitter", "estimate", "coded_state"))

    def live(self, row: Row) -> Series | None:
        """Return the receiver's prediction of a sum of states."""
        live = summed(row, partial(self.ticks, "transmitter", "estimate", "live_state"))
        return (
            summed(row, partial(self.ticks, "receiver", "tick", "live_state")) if live is None else live
        )

    def error(self, place: int, estimate: Series | None) -> Series | None:
        """Return an output less an estimate of it."""
        value = self.output(place)
        return None if value is None or estimate is None else value - estimate

    def loop(self, name: str) -> Series | None:
        """Return a field that the transmitter's loop recorded once a tick."""
        return self.ticks("transmitter", "tick", name, None)

    def applied(self, place: int) -> Series | None:
        return self.ticks("transmitter", "tick", "applied", place)

    def command(self, place: int) -> Series | None:
        """Return the commands of an input, as the receiver sent them if that was recorded."""
        sent = self.ticks("receiver", "tick", "command", place)
        return self.ticks("transmitter", "tick", "commanded", place) if sent is None else sent

    def samples(self, name: str, axis: int | None) -> Series | None:
        """Return a per-sample field, from the transmitter if it was recorded there."""
        for end in ("transmitter", "receiver"):
            found = self._column(end, "sample", name, axis)
            if found is not None:
                return self.base.hold(*found)
        return None

    def word(self, name: str) -> Series | None:
        """Return the symbols of words, one after the other."""
        for end in ("transmitter", "receiver"):
            table = self._table(end, "sample")
            if table is not None and name in table.names:
                return self.base.symbols(table, table[name])
        return None

    def erased(self) -> Series | None:
        """Return 1 where a word was erased, else 0."""
        for end in ("transmitter", "receiver"):
            table = self._table(end, "sample")
            if table is not None:
                words = table["word"] if "word" in table.names else np.zeros((len(table), 0))
                known = np.count_nonzero(~np.isnan(words), axis=1)
                return self.base.hold(table, np.where(known == 0, 1.0, 0.0))
        return None

    def gap(self) -> Series | None:
        """Return the gap gauge, each value held until the next one."""
        table = self._table("transmitter", "gap")
        if table is None or not len(table):
            return None
        samples = self.base.ticks // self.base.ticks_per_sample
        last = np.searchsorted(table.keys, samples, side="right") - 1
        held: Series = np.where(last < 0, np.nan, table["rms_over_floor"][np.maximum(last, 0)])
        return held

    def _table(self, end: str, topic: str) -> Table | None:
        recording = self.transmitter if end == "transmitter" else self.receiver
        return recording.topics.get(topic) if recording is not None else None

    def _column(self, end: str, topic: str, name: str, axis: int | None) -> tuple[Table, Series] | None:
        table = self._table(end, topic)
        if table is None or name not in table.names:
            return None
        values = table[name]
        if values.ndim == 2:
            if axis is None or values.shape[1] <= axis:
                return None
            values = values[:, axis]
        return table, values


class Definition(NamedTuple):
    """A signal that a run may have: its unit, its meaning, and its source."""

    unit: str
    meaning: str
    make: Maker


_OfOutput = Callable[..., Series | None]
"""of a source and, by name, an output's index `at` and its `row`"""


def _tick(end: str, name: str) -> _OfOutput:
    return lambda one, at, row: one.ticks(end, "tick", name, at)


_OF_OUTPUT: tuple[tuple[str, str, _OfOutput], ...] = (
    ("reference", "set-point of {}", _tick("receiver", "reference")),
    ("", "{}, true where the rig knows it, else as measured", lambda one, at, row: one.output(at)),
    ("measured", "{} as the sensor gives it", _tick("transmitter", "measured")),
    ("estimate", "the codec's estimate of {}", lambda one, at, row: one.coded(row)),
    ("estimate_live", "{} as the receiver predicted it", lambda one, at, row: one.live(row)),
    ("error_coded", "{} less its estimate", lambda one, at, row: one.error(at, one.coded(row))),
    ("error_live", "{} less its live estimate", lambda one, at, row: one.error(at, one.live(row))),
    ("range", "range M for {} before the word", lambda one, at, row: one.samples("range", at)),
)
"""A signal of an output, its meaning, and its function of the output's index and row."""

_OF_ALL = {
    "symbol": Definition(
        "", "symbol consumed in the tick's slot; NaN: erased", lambda one: one.word("word")
    ),
    "symbol_sent": Definition("", "symbol sent in the tick's slot", lambda one: one.word("word_sent")),
    "erased": Definition("", "1 where the sample's word was erased", Source.erased),
    "late": Definition("", "1 where the tick's command had not come", lambda one: one.loop("late")),
    "lateness": Definition("ms", "how late the tick began", lambda one: one.loop("lateness_ms")),
    "gap_to_floor": Definition("", "running rms of the live error over the least possible", Source.gap),
}


def definitions(plant: Signals) -> dict[str, Definition]:
    """Return what a run of this plant may have, by name, in the order of the converted files.

    What belongs to the only output has no more in its name than what it is: `estimate`; of several
    outputs it is `estimate_arm`. A name that the plant gives twice, or that is one of ours, gets an
    underscore.
    """
    found: dict[str, Definition] = {}

    def add(name: str, unit: str, meaning: str, make: Maker) -> None:
        while name in found or name in _OF_ALL:
            name += "_"
        found[name] = Definition(unit, meaning, make)

    for what, meaning, make in _OF_OUTPUT:
        for place, one in enumerate(plant.outputs):
            name = one.name
            if what:
                name = what if len(plant.outputs) == 1 else f"{what}_{one.name}"
            made = partial(make, at=place, row=plant.row(place))
            add(name, one.unit, meaning.format(one.words), made)
    only = f"{plant.outputs[0].name}_" if len(plant.outputs) == 1 else ""
    for state, one in enumerate(plant.states):
        if state not in plant.output_states:
            name, meaning = one.name.removeprefix(only), f"the codec's estimate of {one.words}"
            add(
                f"estimate_{name}",
                one.unit,
                meaning,
                partial(Source.coded, row=unit_row(state, len(plant.states))),
            )
    for suffix, meaning, of_input in (
        ("_command", "as commanded", Source.command),
        ("", "as applied", Source.applied),
    ):
        for place, one in enumerate(plant.inputs):
            made = partial(of_input, place=place)
            add(f"{one.name}{suffix}", one.unit, f"{one.words}, {meaning}", made)
    if len(plant.outputs) > 1:
        meaning = "output that the tick's symbol was about, from 0; NaN: erased"
        add("about", "", meaning, lambda one: one.word("about"))
    return found | _OF_ALL


def output_name(plant: Signals, what: str, place: int) -> str:
    """Return the signal that is `what` of an output; `what` empty: the output itself."""
    row = [one for one, _, _ in _OF_OUTPUT].index(what)
    return list(definitions(plant))[row * len(plant.outputs) + place]
