"""Reads the recordings of a run: signals on one time base, rows, events, configuration."""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import orjson

from channel.codec.signals import Signals
from tenbaud.recording.encoding import recorded_signals
from tenbaud.recording.errors import RecordingError
from tenbaud.recording.folder import (
    RECEIVER_NAME,
    TRANSMITTER_NAME,
    RunFolder,
    find_recordings,
    is_own_file,
    read_small,
    read_summary,
)
from tenbaud.recording.reader import Recording
from tenbaud.recording.signals import Definition, Signal, Source, TimeBase, definitions
from tenbaud.recording.table import Series, Table
from tenbaud.sentences import events

if TYPE_CHECKING:
    from tenbaud.config.schema import FlightConfig

ENDS = ("transmitter", "receiver")

SPAN_FREE, SPAN_PER_ROW = 1_000_000, 10
"""Ticks that a time base may span, flat and per recorded tick: hours without a row are no damage."""
TICK_S_MIN = 1e-6
TICKS_PER_SAMPLE_MAX = 1_000_000


class RecordedRun:
    """What was recorded of one flight, and what stands beside it; `Run` adds figures and pictures."""

    def __init__(self, path: str | Path) -> None:
        """`path` is the folder of a run, or one recording; RecordingError if there is none."""
        self.path = Path(path)
        found = find_recordings(self.path)
        self.folder = RunFolder(self.path if self.path.is_dir() else self.path.parent)
        names = {TRANSMITTER_NAME: "transmitter", RECEIVER_NAME: "receiver"}
        self._files = {names.get(file.name) or self._role(file): file for file in found}
        self._read: dict[str, Recording] = {}
        self._made: dict[str, Signal | None] = {}

    @staticmethod
    def _role(file: Path) -> str:
        role = Recording(file).metadata.get("role", "")
        if role not in ENDS:
            raise RecordingError(
                f"{file} does not say which end recorded it. Give the folder of a run, or its "
                f"{TRANSMITTER_NAME} or {RECEIVER_NAME}."
            )
        return role

    def __repr__(self) -> str:
        try:
            base = self.base
        except RecordingError:
            return f"<Run {self.path}: no ticks>"
        return (
            f"<Run {self.path}: {len(base.ticks)} ticks of {base.tick_s:g} s, "
            f"{' and '.join(self._files)}{'' if self.complete else ', cut'}>"
        )

    # Signals

    @property
    def time_s(self) -> Series:
        """Flight time of every tick, in seconds from tick 0: what all signals are over."""
        return np.asarray(self.base.ticks * self.base.tick_s, dtype=np.float64)

    @property
    def names(self) -> list[str]:
        """The signals that this run has."""
        return list(self.signals)

    @cached_property
    def plant(self) -> Signals:
        """What the plant's states, inputs and outputs are called, their units and groups."""
        return recorded_signals(self.metadata)

    @cached_property
    def _definitions(self) -> dict[str, Definition]:
        return definitions(self.plant)

    @cached_property
    def signals(self) -> dict[str, Signal]:
        """All signals of this run, with units and meanings."""
        found = {name: self.signal(name) for name in self._definitions}
        return {name: signal for name, signal in found.items() if signal is not None}

    @property
    def units(self) -> dict[str, str]:
        """The unit of every signal; empty where it has none."""
        return {name: signal.unit for name, signal in self.signals.items()}

    def signal(self, name: str) -> Signal | None:
        """Return one signal; None if this run did not record it. KeyError for an unknown name."""
        if name not in self._made:
            unit, meaning, make = self._definitions[name]
            values = make(Source(self.base, self._end("transmitter"), self._end("receiver")))
            if values is not None and np.isnan(values).all():
                values = None
            self._made[name] = None if values is None else Signal(name, values, unit, meaning)
        return self._made[name]

    def values_of(self, name: str) -> Series:
        """Return the values of one signal; AttributeError, with the reason, if it is not there."""
        if name not in self._definitions:
            known = ", ".join(self._definitions)
            raise AttributeError(f"a run has no {name!r}; its signals are {known}")
        signal = self.signal(name)
        if signal is None:
            raise AttributeError(
                f"this run has no {name!r}: {self._why_missing()}; it has {', '.join(self.names)}"
            )
        return signal.values

    def __getattr__(self, name: str) -> Series:
        if name.startswith("_"):
            raise AttributeError(name)
        return self.values_of(name)

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self._definitions]

    def _why_missing(self) -> str:
        absent = [end for end in ENDS if end not in self._files]
        return f"the {absent[0]}'s recording is not here" if absent else "it was not recorded"

    # What else was recorded

    def table(self, end: str, topic: str) -> Table:
        """Return the rows of one topic as they were recorded, `run.table("transmitter", "sample")`."""
        return self.tables(end).topic(topic)

    def topics(self, end: str) -> list[str]:
        """Return the topics that an end recorded."""
        tables = self._end(end)
        return [] if tables is None else list(tables.topics)

    @property
    def ends(self) -> list[str]:
        """The ends whose recordings are here."""
        return [end for end in ENDS if end in self._files]

    @property
    def events(self) -> list[dict[str, Any]]:
        """The events of both ends, in order of flight time: the recorded fields, `end` and `text`.

        The text is a sentence made from the fields, for people.
        """
        found = [
            {"end": end, **row, "text": events.event_text(row)}
            for end in self.ends
            for row in (self.table(end, "event").rows if "event" in self.topics(end) else [])
        ]
        return sorted(found, key=lambda event: event.get("time_s") or 0.0)

    @property
    def metadata(self) -> dict[str, str]:
        """The metadata that the run wrote when it began."""
        return self.tables(self.ends[0]).metadata

    @property
    def complete(self) -> bool:
        """False if a recording was cut; what it held up to the cut is here."""
        return all(self.tables(end).complete for end in self.ends)

    @property
    def notes(self) -> list[str]:
        """Notes to read before trusting the recordings: another version, a cut, holes."""
        return [note for end in self.ends for note in self.tables(end).notes]

    @cached_property
    def summary(self) -> dict[str, Any]:
        """The figures in `summary.json`; empty without it."""
        return read_summary(self.folder.summary)

    @cached_property
    def config(self) -> FlightConfig:
        """The configuration that was flown, checked anew.

        Classes from outside that it names are not imported: `config.allowing_code()` permits that.
        """
        from tenbaud.config.load import load_config

        if not is_own_file(self.folder.config):
            raise RecordingError(f"{self.folder.path} holds no {self.folder.config.name}.")
        return load_config(path=self.folder.config, recorded=True)

    # Reading

    def tables(self, end: str) -> Recording:
        """Return all topics of an end; RecordingError if it was not recorded here."""
        tables = self._end(end)
        if tables is None:
            raise RecordingError(f"{self.path} holds no recording of the {end}.")
        return tables

    def _end(self, end: str) -> Recording | None:
        if end not in self._files:
            return None
        if end not in self._read:
            self._read[end] = Recording(self._files[end])
            _ = self._read[end].end  # refuses a file whose end is none
        return self._read[end]

    @cached_property
    def base(self) -> TimeBase:
        """The ticks of this run."""
        for end in self.ends:
            tables = self.tables(end)
            if "tick" in tables.topics:
                break
        else:
            raise RecordingError(f"{self.path} holds no ticks: the run ended before it flew.")
        known = tables.topics["tick"].keys
        first, last = int(known.min()), int(known.max())
        if last - first > SPAN_FREE + SPAN_PER_ROW * len(known):
            raise RecordingError(
                f"{tables.path} holds {len(known)} ticks between tick {first} and tick {last}: too few "
                "for signals on one time base. The rows themselves are in the tables: "
                f'Run(...).table("{end}", "tick").'
            )
        tick_s, per_sample = _timing(tables.metadata, self.folder.config)
        return TimeBase(np.arange(first, last + 1), tick_s, per_sample)


def _timing(metadata: dict[str, str], config: Path) -> tuple[float, int]:
    """Return tick and ticks per sample, from the recording's own head or the folder's file."""
    sources: tuple[Callable[[], Any], ...] = (
        lambda: orjson.loads(metadata["shared_config"])["timing"],
        lambda: tomllib.loads(read_small(config))["timing"],
        lambda: {"tick_s": metadata["tick_s"], "symbol_period_s": 0.1},
    )
    for source in sources:
        try:
            timing = source()
            tick_s, symbol_s = float(timing["tick_s"]), float(timing["symbol_period_s"])
        except (OSError, KeyError, ValueError, TypeError, OverflowError, RecursionError):
            continue
        if TICK_S_MIN <= tick_s <= symbol_s <= TICKS_PER_SAMPLE_MAX * tick_s:
            return tick_s, max(1, round(symbol_s / tick_s))
    return 0.01, 10
