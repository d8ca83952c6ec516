"""A topic of a recording as columns: numpy arrays, one entry per row."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import orjson
from numpy.typing import NDArray

from channel.recording import Field, RecordChannel
from tenbaud.recording.errors import RecordingError
from tenbaud.recording.reader import MessageStream, Row
from tenbaud.recording.writer import END_METADATA, RUN_METADATA

Series = NDArray[np.float64]


class Table:
    """The rows of one topic; they are decoded when the first of them is asked for.

    `table["digest"]` is a column: numbers as float64 (null is NaN), booleans as 0 and 1, a list of
    numbers as a row of a two-dimensional array, texts as an object array (null is None).
    """

    def __init__(self, channel: RecordChannel, times_ns: list[int], texts: list[bytes]) -> None:
        self.channel = channel
        self.times_ns = times_ns
        self._texts = texts
        self._columns: dict[str, NDArray[Any]] = {}

    @cached_property
    def rows(self) -> list[Row]:
        """The rows as they were recorded, in the order of the file."""
        with _collector_paused():
            # One parse for all rows of a topic takes half the time of one per row.
            rows: list[Row] = orjson.loads(b"[" + b",".join(self._texts) + b"]")
        self._texts = []
        return rows

    def __len__(self) -> int:
        return len(self.times_ns)

    @property
    def names(self) -> list[str]:
        """The names of the columns."""
        return [one.name for one in self.channel.fields]

    @property
    def units(self) -> dict[str, str]:
        """The unit of each column; empty where it has none."""
        return {one.name: one.unit for one in self.channel.fields}

    def __getitem__(self, name: str) -> NDArray[Any]:
        if name not in self._columns:
            self._columns[name] = column(self.rows, self._field(name))
        return self._columns[name]

    def _field(self, name: str) -> Field:
        for one in self.channel.fields:
            if one.name == name:
                return one
        raise KeyError(f"{self.channel.topic!r} has no column {name!r}; it has {', '.join(self.names)}")


def column(rows: list[Row], one: Field) -> NDArray[Any]:
    """Return one field of many rows as an array."""
    name = one.name
    values = [row.get(name) for row in rows]
    if one.type == "string":
        return np.array(values, dtype=object)
    if one.type in ("numbers", "integers"):
        return _lists(values)
    return np.array(values, dtype=np.float64)


def _lists(values: list[Any]) -> Series:
    """Return lists of numbers as the rows of an array, NaN where there is none."""
    try:
        whole = np.array(values, dtype=np.float64)
    except ValueError:  # some rows are null or shorter than others
        width = max((len(value) for value in values if value is not None), default=0)
        whole = np.full((len(values), width), np.nan)
        for index, value in enumerate(values):
            if value is not None:
                whole[index, : len(value)] = value
    return whole if whole.ndim == 2 else np.full((len(values), 0), np.nan)


@dataclass(slots=True)
class Tables:
    """All topics of one recording."""

    path: Path
    complete: bool
    metadata: dict[str, str]
    end: dict[str, str]
    """what the recorder said when it finished: rows written and dropped; empty if the file was cut"""
    topics: dict[str, Table]

    def topic(self, name: str) -> Table:
        """Return a topic; RecordingError if there is none."""
        if name not in self.topics:
            raise RecordingError(
                f"The recording {self.path} has no topic {name!r}. "
                f"It has: {', '.join(self.topics) or 'none at all'}."
                + ("" if self.complete else " It was cut or damaged before one.")
            )
        return self.topics[name]


def read_tables(path: Path) -> Tables:
    """Read a whole recording; one that was cut gives its rows up to the cut.

    Raises RecordingError for a file that is missing, empty or no recording of ours.
    """
    stream = MessageStream(path)
    times: dict[str, list[int]] = {}
    texts: dict[str, list[bytes]] = {}
    with _collector_paused():
        for topic, time_ns, data in stream.undecoded():
            if topic not in times:
                times[topic], texts[topic] = [], []
            times[topic].append(time_ns)
            texts[topic].append(data)
    topics = {topic: Table(stream.channels[topic], times[topic], texts[topic]) for topic in times}
    return Tables(
        path,
        stream.complete,
        stream.metadata.get(RUN_METADATA, {}),
        stream.metadata.get(END_METADATA, {}),
        topics,
    )


@contextmanager
def _collector_paused() -> Iterator[None]:
    """Hundreds of thousands of new objects wake the collector again and again, for nothing."""
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()
