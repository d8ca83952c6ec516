"""The data for a flight's figure, in bounded memory: gathered in flight, or from its rows.

A recorder keeps an overview beside the rows that it writes and stores it at the end of a long recording
so that ten million ticks are drawn at once when they have been flown. Everybody
else reads the rows: the statements of a file about its rows may be false.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import islice
from typing import Any

import numpy as np
import orjson

from tenbaud.recording.envelope import Envelope, Means, Series

SYMBOLS_DRAWN_SINGLY = 1200
"""Beyond these the bits of a flight merge into a solid block; their mean is drawn instead."""
PENDING_MAX = 50_000
"""Ticks that wait for their estimate, or the other way round."""

CURVES = ("pitch", "reference", "coded", "live", "error_coded", "error_live", "range")
MARKS = ("erased", "flipped", "desync", "rejoin")

FIELDS: dict[str, tuple[str, ...]] = {
    "tick": ("tick", "true_rad", "measured_rad", "reference_rad"),
    "estimate": ("tick", "coded_state", "live_state"),
    "sample": ("range", "word", "word_sent"),
    "event": ("kind",),
}
"""The topics and fields that are looked at."""

Columns = Callable[[str], list[Any] | None]
"""Field name -> its values in some rows; None if these rows have no such field."""


class Overview:
    """Curves and marks of a flight, of the first measured axis."""

    def __init__(self) -> None:
        self.curves = {name: Envelope() for name in CURVES}
        self.marks = {name: Envelope() for name in MARKS}
        self.symbols = Means(SYMBOLS_DRAWN_SINGLY)
        self._pitch: dict[int, float] = {}
        self._waiting: dict[int, tuple[float, float, float]] = {}
        self._last_word: tuple[float, list[Any] | None] | None = None

    def add(self, topic: str, times_ns: Sequence[int], columns: Columns) -> None:
        """Add rows of one topic, in the order of the file."""
        times = np.array(times_ns, dtype=np.float64) / 1e9
        match topic:
            case "tick":
                self._add_ticks(times, columns)
            case "estimate":
                self._add_estimates(times, columns)
            case "sample":
                self._add_samples(times, columns)
            case "event":
                self._add_events(times, columns)

    def finish(self) -> None:
        """Add what waited for a row that does not come."""
        if self._last_word is not None:
            time_s, word = self._last_word
            self._last_word = None
            self.symbols.add(*_symbols([time_s, time_s], [word]))

    def _add_ticks(self, times: Series, columns: Columns) -> None:
        reference = columns("reference_rad")
        if reference is not None:
            self.curves["reference"].add(times, np.array(reference, dtype=np.float64))
        measured = columns("measured_rad")
        if measured is None:
            return
        pitch = _first(measured)
        true = columns("true_rad")
        if true is not None:
            known = _first(true)
            pitch = np.where(np.isnan(known), pitch, known)
        self.curves["pitch"].add(times, pitch)
        self._pitch.update(zip(columns("tick") or (), pitch.tolist(), strict=False))
        self._join()

    def _add_estimates(self, times: Series, columns: Columns) -> None:
        coded, live = _first(columns("coded_state") or ()), _first(columns("live_state") or ())
        if not len(times) == len(coded) == len(live):
            return
        self.curves["coded"].add(times, coded)
        self.curves["live"].add(times, live)
        rows = zip(times.tolist(), coded.tolist(), live.tolist(), strict=True)
        self._waiting.update(zip(columns("tick") or (), rows, strict=False))
        self._join()

    def _join(self) -> None:
        """Take the errors of the ticks of which both pitch and estimate are there."""
        ready = sorted(self._waiting.keys() & self._pitch.keys())
        if ready:
            pitch = np.array([self._pitch.pop(tick) for tick in ready])
            rows = np.array([self._waiting.pop(tick) for tick in ready])
            self.curves["error_coded"].add(rows[:, 0], pitch - rows[:, 1])
            self.curves["error_live"].add(rows[:, 0], pitch - rows[:, 2])
        for waiting in (self._pitch, self._waiting):
            if len(waiting) > PENDING_MAX:
                for tick in list(islice(waiting, len(waiting) - PENDING_MAX // 2)):
                    del waiting[tick]

    def _add_samples(self, times: Series, columns: Columns) -> None:
        words = columns("word")
        if words is None:
            return
        sent = columns("word_sent") or [None] * len(words)
        ranges = columns("range")
        if ranges is not None:
            self.curves["range"].add(times, _first(ranges))
        erased = np.array([word is None for word in words])
        flipped = np.array(
            [
                word is not None and other is not None and list(word) != list(other)
                for word, other in zip(words, sent, strict=True)
            ]
        )
        self._mark("erased", times[erased])
        self._mark("flipped", times[flipped])
        times_s = times.tolist()
        if self._last_word is not None:
            times_s.insert(0, self._last_word[0])
            words = [self._last_word[1], *words]
        # The symbols of a word fill its sample period evenly, which the next row tells.
        self.symbols.add(*_symbols(times_s, words[:-1]))
        self._last_word = (times_s[-1], words[-1])

    def _add_events(self, times: Series, columns: Columns) -> None:
        for time_s, kind in zip(times, columns("kind") or [], strict=False):
            if kind in ("desync", "rejoin"):
                self._mark(kind, np.array([time_s]))

    def _mark(self, name: str, times: Series) -> None:
        self.marks[name].add(times, np.zeros(len(times)))


def marks_of(envelope: Envelope) -> Series:
    """Return the times of marks, thinned."""
    times, values = envelope.curve()
    return times[~np.isnan(values)]


def _first(values: Sequence[Any]) -> Series:
    """The first axis of recorded numbers or lists of numbers; NaN for null."""
    first = [
        (value[0] if value else None) if isinstance(value, list | tuple) else value for value in values
    ]
    return np.array(first, dtype=np.float64)


def _symbols(times_s: list[float], words: Sequence[Sequence[Any] | None]) -> tuple[Series, Series]:
    """Return time and value of every symbol; `times_s` has one more entry, the end of the last word."""
    times: list[float] = []
    values: list[float] = []
    for index, word in enumerate(words):
        count = len(word) if word else 1
        period_s = max(0.0, times_s[index + 1] - times_s[index])
        times += [times_s[index] + period_s * slot / count for slot in range(count)]
        values += word if word else [np.nan]
    return np.array(times), np.array(values, dtype=np.float64)


def packed(overview: Overview) -> dict[str, str]:
    """Return an overview as metadata."""
    overview.finish()
    parts: dict[str, Any] = {name: one.curve() for name, one in overview.curves.items()}
    parts |= {name: one.curve() for name, one in overview.marks.items()}
    parts["symbols"] = (*overview.symbols.curve(), overview.symbols.thinned)
    return {
        name: orjson.dumps(part, option=orjson.OPT_SERIALIZE_NUMPY).decode()
        for name, part in parts.items()
    }


def unpacked(metadata: Mapping[str, str]) -> Overview | None:
    """Return the overview in a file's metadata; None where it is not all there."""
    overview = Overview()
    try:
        for name, held in (overview.curves | overview.marks).items():
            times, values = orjson.loads(metadata[name])
            held.restore(np.array(times, dtype=np.float64), np.array(values, dtype=np.float64))
        times, values, thinned = orjson.loads(metadata["symbols"])
        times, values = np.array(times, dtype=np.float64), np.array(values, dtype=np.float64)
        overview.symbols.restore(times, values, bool(thinned))
    except (KeyError, ValueError, TypeError):
        return None
    return overview
