"""The data for a flight's figure, in bounded memory: gathered in flight, or from its rows.

A recorder keeps an overview beside the rows that it writes and stores it at the end of a long recording
so that ten million ticks are drawn at once when they have been flown. Everybody
else reads the rows: the statements of a file about its rows may be false.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import islice
from typing import Any

import numpy as np
import orjson

from channel.codec.signals import Signals
from channel.protocol.recording import RecordChannel
from tenbaud.recording.envelope import Envelope, Means, Series
from tenbaud.recording.signals import summed

SYMBOLS_DRAWN_SINGLY = 1200
"""Beyond these the bits of a flight merge into a solid block; their mean is drawn instead."""
PENDING_MAX = 50_000
"""Ticks that wait for their estimate, or the other way round."""

ROWS_OF_LONG_FLIGHT = 300_000
"""A recording of fewer rows is read again in a second or two."""
ROWS_PER_TICK_MAX = 3
"""What a transmitter records of a tick, of its estimate and of its sample."""
BLOCK_ROWS = 512
"""Rows of one topic that are kept as they are, until they are added in one go."""

CURVES = ("value", "reference", "coded", "live", "error_coded", "error_live", "range")
"""Of every output."""
MARKS = ("erased", "flipped", "desync", "rejoin")

FIELDS: dict[str, tuple[str, ...]] = {
    "tick": ("tick", "true", "measured", "applied", "reference"),
    "estimate": ("tick", "coded_state", "live_state"),
    "sample": ("range", "word", "word_sent", "about"),
    "event": ("kind",),
}
"""The topics and fields that are looked at."""

Columns = Mapping[str, Sequence[Any]]
"""Field name -> its values in some rows; a field that these rows do not have is not there."""


class Overview:
    """Curves of every output and input of a plant, and marks."""

    def __init__(self, plant: Signals) -> None:
        self.plant = plant
        self.curves = {name: [Envelope() for _ in plant.outputs] for name in CURVES}
        self.curves["applied"] = [Envelope() for _ in plant.inputs]
        self.marks = {name: Envelope() for name in MARKS}
        self.symbols = Means(SYMBOLS_DRAWN_SINGLY)
        self.about = [Means(SYMBOLS_DRAWN_SINGLY) for _ in plant.outputs]
        """of each output: 1 for a symbol that was about it, else 0"""
        self._values: dict[int, list[float]] = {}
        self._waiting: dict[int, list[float]] = {}
        self._last_words: tuple[list[float], list[Any], list[Any]] = ([], [], [])
        """time, word and what it was about of the last sample, whose end the next one shows"""

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

    def held(self) -> dict[str, Envelope]:
        """Return every curve and mark by a name of its own."""
        curves = {
            f"{name}_{place}": one
            for name, held in self.curves.items()
            for place, one in enumerate(held)
        }
        return curves | self.marks

    def means(self) -> dict[str, Means]:
        """Return what is kept as means, by a name of its own."""
        about = self.about if len(self.about) > 1 else []
        return {"symbols": self.symbols} | {f"about_{place}": one for place, one in enumerate(about)}

    def finish(self) -> None:
        """Add what waited for a row that does not come."""
        times_s, words, about = self._last_words
        self._last_words = ([], [], [])
        self._add_symbols([*times_s, *times_s], words, about)

    def _add_curves(self, name: str, times: Series, table: Series) -> None:
        for place, envelope in enumerate(self.curves[name]):
            envelope.add(times, table[:, place])

    def _add_ticks(self, times: Series, columns: Columns) -> None:
        outputs = len(self.plant.outputs)
        for name, width in (("reference", outputs), ("applied", len(self.plant.inputs))):
            if name in columns:
                self._add_curves(name, times, _table(columns[name], width))
        if "measured" not in columns:
            return
        values = _table(columns["measured"], outputs)
        if "true" in columns:
            known = _table(columns["true"], outputs)
            values = np.where(np.isnan(known), values, known)
        self._add_curves("value", times, values)
        self._values.update(zip(columns.get("tick", ()), values.tolist(), strict=False))
        self._join()

    def _add_estimates(self, times: Series, columns: Columns) -> None:
        coded, live = (self._outputs(columns.get(name, ())) for name in ("coded_state", "live_state"))
        if not len(times) == len(coded) == len(live):
            return
        self._add_curves("coded", times, coded)
        self._add_curves("live", times, live)
        rows = np.column_stack((times, coded, live)).tolist()
        self._waiting.update(zip(columns.get("tick", ()), rows, strict=False))
        self._join()

    def _outputs(self, states: Sequence[Any]) -> Series:
        """Return the outputs of model states; NaN for one that is no sum of them."""
        table = _table(states, len(self.plant.states))
        found = np.full((len(states), len(self.plant.outputs)), np.nan)
        for place in range(found.shape[1]):
            values = summed(self.plant.row(place), lambda state: table[:, state])
            if values is not None:
                found[:, place] = values
        return found

    def _join(self) -> None:
        """Take the errors of the ticks of which both values and estimates are there."""
        ready = sorted(self._waiting.keys() & self._values.keys())
        if ready:
            count = len(self.plant.outputs)
            values = np.array([self._values.pop(tick) for tick in ready])
            rows = np.array([self._waiting.pop(tick) for tick in ready])
            self._add_curves("error_coded", rows[:, 0], values - rows[:, 1 : 1 + count])
            self._add_curves("error_live", rows[:, 0], values - rows[:, 1 + count :])
        for waiting in (self._values, self._waiting):
            if len(waiting) > PENDING_MAX:
                for tick in list(islice(waiting, len(waiting) - PENDING_MAX // 2)):
                    del waiting[tick]

    def _add_samples(self, times: Series, columns: Columns) -> None:
        if "word" not in columns:
            return
        words = columns["word"]
        sent = columns.get("word_sent", [None] * len(words))
        if "range" in columns:
            self._add_curves("range", times, _table(columns["range"], len(self.plant.outputs)))
        erased = np.array([word is None for word in words])
        flipped = np.array(
            [
                word is not None and other is not None and list(word) != list(other)
                for word, other in zip(words, sent, strict=True)
            ]
        )
        self._mark("erased", times[erased])
        self._mark("flipped", times[flipped])
        about = columns.get("about", [None] * len(words))
        held = zip(self._last_words, (times.tolist(), words, about), strict=True)
        times_s, words, about = ([*before, *new] for before, new in held)
        # The symbols of a word fill its sample period evenly, which the next row tells.
        self._add_symbols(times_s, words[:-1], about[:-1])
        self._last_words = (times_s[-1:], words[-1:], about[-1:])

    def _add_symbols(self, times_s: list[float], words: list[Any], about: list[Any]) -> None:
        if not words:
            return
        times, values = _symbols(times_s, words)
        self.symbols.add(times, values)
        if len(self.about) > 1:
            # A receiver does not record what symbols were about.
            places = [
                None if word is None else of or (None,) * len(word)
                for word, of in zip(words, about, strict=True)
            ]
            _, outputs = _symbols(times_s, places)
            for place, means in enumerate(self.about):
                means.add(times, np.where(np.isnan(outputs), np.nan, outputs == place))

    def _add_events(self, times: Series, columns: Columns) -> None:
        for time_s, kind in zip(times, columns.get("kind", ()), strict=False):
            if kind in ("desync", "rejoin"):
                self._mark(kind, np.array([time_s]))

    def _mark(self, name: str, times: Series) -> None:
        self.marks[name].add(times, np.zeros(len(times)))


def marks_of(envelope: Envelope) -> Series:
    """Return the times of marks, thinned."""
    times, values = envelope.curve()
    return times[~np.isnan(values)]


def _table(values: Sequence[Any], width: int) -> Series:
    """Return recorded lists of numbers as rows of one width; NaN for null and for what is not there."""
    nothing = (None,) * width
    rows = [(*(value or ()), *nothing)[:width] for value in values]
    return np.array(rows, dtype=np.float64).reshape(len(rows), width)


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
    parts: dict[str, Any] = {name: one.curve() for name, one in overview.held().items()}
    for name, means in overview.means().items():
        parts[name] = (*means.curve(), means.thinned)
    return {
        name: orjson.dumps(part, option=orjson.OPT_SERIALIZE_NUMPY).decode()
        for name, part in parts.items()
    }


def unpacked(metadata: Mapping[str, str], plant: Signals) -> Overview | None:
    """Return the overview in a file's metadata; None where it is not all there."""
    overview = Overview(plant)
    try:
        for name, held in overview.held().items():
            times, values = orjson.loads(metadata[name])
            held.restore(np.array(times, dtype=np.float64), np.array(values, dtype=np.float64))
        for name, means in overview.means().items():
            times, values, thinned = orjson.loads(metadata[name])
            times, values = np.array(times, dtype=np.float64), np.array(values, dtype=np.float64)
            means.restore(times, values, bool(thinned))
    except (KeyError, ValueError, TypeError):
        return None
    return overview


def is_long(flight_ticks: int) -> bool:
    """Return whether a transmitter that flies so long may record a long flight."""
    return ROWS_PER_TICK_MAX * flight_ticks >= ROWS_OF_LONG_FLIGHT


class OverviewRecorder:
    """A `Recorder` that gathers an overview from the rows written to it, some at a time."""

    def __init__(self, plant: Signals) -> None:
        self._overview = Overview(plant)
        self._rows: dict[str, tuple[list[int], list[Sequence[object]]]] = {}
        self._names: dict[str, list[str]] = {}
        self._count = 0

    def write(self, channel: RecordChannel, time_ns: int, row: Sequence[object]) -> None:
        """Take one row, filed at tick 0 where it came before."""
        topic = channel.topic
        held = self._rows.get(topic)
        if held is None:
            if topic not in FIELDS:
                return
            self._names[topic] = [one.name for one in channel.fields]
            held = self._rows[topic] = ([], [])
        times, rows = held
        times.append(time_ns if time_ns > 0 else 0)
        rows.append(row)
        if len(rows) >= BLOCK_ROWS:
            self._take(topic)

    def overview(self) -> Overview:
        """Return what was gathered so far."""
        for topic in self._rows:
            self._take(topic)
        return self._overview

    def metadata(self) -> dict[str, str] | None:
        """Return the overview as metadata of the file; None for a flight that is quickly read again."""
        overview = self.overview()
        if self._count < ROWS_OF_LONG_FLIGHT:
            return None
        return packed(overview)

    def _take(self, topic: str) -> None:
        times, rows = self._rows[topic]
        self._rows[topic] = ([], [])
        self._count += len(rows)
        if rows:
            columns = dict(zip(self._names[topic], zip(*rows, strict=True), strict=True))
            self._overview.add(topic, times, columns)
