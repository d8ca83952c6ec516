"""The signals of a flight by name, on one time base: the ticks.

What was recorded per tick stands at its tick; what was recorded per sample is held over the sample's
ticks. Where nothing was recorded there is NaN. Of several measured axes it is the first; the others
are in the tables (`Run.table`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tenbaud.recording.table import Series, Table, Tables


@dataclass(frozen=True, slots=True)
class Signal:
    """One signal: values on the common time base, their unit and what they mean."""

    name: str
    values: Series
    unit: str
    description: str

    @property
    def column(self) -> str:
        """The name with its unit, for a file that has no other place for it: `pitch_rad`."""
        unit = {"": "", "V": "volts", "rad/s": "rad_per_s"}.get(self.unit, self.unit)
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


Maker = Callable[["Source"], Series | None]


@dataclass(frozen=True, slots=True)
class Source:
    """The sources of signals. An end that was not recorded is None."""

    base: TimeBase
    transmitter: Tables | None
    receiver: Tables | None

    def ticks(self, end: str, topic: str, name: str, axis: int | None) -> Series | None:
        """Return a per-tick field on the time base; None where it was not recorded."""
        found = self._column(end, topic, name, axis)
        return None if found is None else self.base.place(*found)

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

    def _table(self, end: str, topic: str) -> Table | None:
        tables = self.transmitter if end == "transmitter" else self.receiver
        return tables.topics.get(topic) if tables is not None else None

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


def _ticks(end: str, topic: str, name: str, axis: int | None = 0) -> Maker:
    return lambda source: source.ticks(end, topic, name, axis)


def _samples(name: str, axis: int | None = 0) -> Maker:
    return lambda source: source.samples(name, axis)


def _pitch(source: Source) -> Series | None:
    true = source.ticks("transmitter", "tick", "true_rad", 0)
    measured = source.ticks("transmitter", "tick", "measured_rad", 0)
    if true is None or measured is None:
        return measured if true is None else true
    return np.where(np.isnan(true), measured, true)


def _estimate(source: Source, axis: int) -> Series | None:
    return source.ticks("transmitter", "estimate", "coded_state", axis)


def _live(source: Source) -> Series | None:
    live = source.ticks("transmitter", "estimate", "live_state", 0)
    return source.ticks("receiver", "tick", "live_state", 0) if live is None else live


def _less(one: Series | None, other: Series | None) -> Series | None:
    return None if one is None or other is None else one - other


def _volts(axis: int) -> Maker:
    def make(source: Source) -> Series | None:
        sent = source.ticks("receiver", "tick", "command_volts", axis)
        known = source.ticks("transmitter", "tick", "commanded_volts", axis)
        return known if sent is None else sent

    return make


def _gap(source: Source) -> Series | None:
    """Return the gap gauge, each value held until the next one."""
    table = None if source.transmitter is None else source.transmitter.topics.get("gap")
    if table is None or not len(table):
        return None
    samples = source.base.ticks // source.base.ticks_per_sample
    last = np.searchsorted(table.keys, samples, side="right") - 1
    held: Series = np.where(last < 0, np.nan, table["rms_over_floor"][np.maximum(last, 0)])
    return held


def _erased(source: Source) -> Series | None:
    for end in (source.transmitter, source.receiver):
        table = None if end is None else end.topics.get("sample")
        if table is not None:
            words = table["word"] if "word" in table.names else np.zeros((len(table), 0))
            known = np.count_nonzero(~np.isnan(words), axis=1)
            return source.base.hold(table, np.where(known == 0, 1.0, 0.0))
    return None


SIGNALS: tuple[tuple[str, str, str, Maker], ...] = (
    (
        "reference",
        "rad",
        "set-point of the controller",
        _ticks("receiver", "tick", "reference_rad", None),
    ),
    ("pitch", "rad", "true angle where the rig knows it, else as measured", _pitch),
    ("measured", "rad", "angle as the encoder gives it", _ticks("transmitter", "tick", "measured_rad")),
    ("estimate", "rad", "the codec's estimate of the angle", lambda source: _estimate(source, 0)),
    ("estimate_live", "rad", "the receiver's predicted estimate of the tick", _live),
    ("estimate_rate", "rad/s", "the codec's estimate of the rate", lambda source: _estimate(source, 1)),
    (
        "error_coded",
        "rad",
        "pitch less estimate",
        lambda source: _less(_pitch(source), _estimate(source, 0)),
    ),
    (
        "error_live",
        "rad",
        "pitch less live estimate",
        lambda source: _less(_pitch(source), _live(source)),
    ),
    ("range", "rad", "range M of the coder before the word", _samples("range")),
    (
        "symbol",
        "",
        "symbol consumed in the tick's slot; NaN: erased",
        lambda source: source.word("word"),
    ),
    ("symbol_sent", "", "symbol sent in the tick's slot", lambda source: source.word("word_sent")),
    ("erased", "", "1 where the sample's word was erased", _erased),
    ("front_command", "V", "voltage commanded, front motor", _volts(0)),
    ("rear_command", "V", "voltage commanded, rear motor", _volts(1)),
    ("front", "V", "voltage applied, front motor", _ticks("transmitter", "tick", "applied_volts", 0)),
    ("rear", "V", "voltage applied, rear motor", _ticks("transmitter", "tick", "applied_volts", 1)),
    (
        "late",
        "",
        "1 where the tick's command had not come",
        _ticks("transmitter", "tick", "late", None),
    ),
    ("lateness", "ms", "how late the tick began", _ticks("transmitter", "tick", "lateness_ms", None)),
    ("gap_to_floor", "", "running rms of the live error over the least possible", _gap),
)
"""Name, unit, meaning and where it comes from. The order is that of the converted files."""
