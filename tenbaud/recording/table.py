"""A topic of a recording as columns: numpy arrays, one entry per row."""

from __future__ import annotations

import gc
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cached_property
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from channel.protocol.recording import Field, RecordChannel
from tenbaud.recording.errors import RecordingError
from tenbaud.recording.rows import KEYS, Row

Series = NDArray[np.float64]

CELLS_PER_ROW_MAX = 1024
"""Values in a list, each a column; a codec's state has some ten."""


class MissingColumn(RecordingError, KeyError):
    """A topic has no such column; the text names those that it has."""

    __str__ = RecordingError.__str__


class Source(Protocol):
    """The recording that a table is of."""

    path: Path

    def rows(self, topic: str) -> Iterator[tuple[int, Row]]:
        """Stream flight times and rows."""

    def read(self, wanted: Mapping[str, Sequence[str]]) -> None:
        """Fill columns of topics in one pass."""


class Table:
    """The rows of one topic, read from the file when they are first asked for.

    `table["digest"]` is a column: numbers as float64 (null is NaN), booleans as 0 and 1, a list of
    numbers as a row of a two-dimensional array, texts as an object array (null is None). All columns
    take some tenth of the memory of `rows`.
    """

    def __init__(self, source: Source, channel: RecordChannel) -> None:
        self.channel = channel
        self.first_time_ns = self.last_time_ns = 0
        self._source = source
        self._count = 0
        self._columns: dict[str, NDArray[Any]] = {}
        self._times_ns: NDArray[np.uint64] | None = None

    def count(self, times_ns: Sequence[int]) -> None:
        """Take in that the file has rows of these flight times."""
        self.first_time_ns = min(self.first_time_ns if self._count else times_ns[0], *times_ns)
        self.last_time_ns = max(self.last_time_ns, *times_ns)
        self._count += len(times_ns)

    @cached_property
    def rows(self) -> list[Row]:
        """The rows as they were recorded, in the order of the file: all of them as objects."""
        with _collector_paused():
            return [row for _, row in self._source.rows(self.channel.topic)]

    def __len__(self) -> int:
        return self._count

    @property
    def names(self) -> list[str]:
        return [one.name for one in self.channel.fields]

    @property
    def units(self) -> dict[str, str]:
        """The unit of each column; empty where it has none."""
        return {one.name: one.unit for one in self.channel.fields}

    @property
    def times_ns(self) -> NDArray[np.uint64]:
        """The flight time of each row, as the file has it."""
        if self._times_ns is None:
            self._read([self.channel.fields[0]])
        assert self._times_ns is not None
        return self._times_ns

    @property
    def keys(self) -> NDArray[np.int64]:
        """The ticks, samples or slots of the rows; RecordingError where the topic has none."""
        name = self.names[0]
        if name not in KEYS:
            raise MissingColumn(f"{self.channel.topic!r} counts its rows by no tick, sample or slot")
        return self[name].astype(np.int64)

    def __getitem__(self, name: str) -> NDArray[Any]:
        if name not in self._columns:
            self._field(name)
            # The cost is in the pass over the file: one for all columns, texts apart, which are large.
            texts = self._field(name).type == "string"
            self._read([one for one in self.channel.fields if (one.type == "string") == texts])
        return self._columns[name]

    def read(self, *names: str) -> list[NDArray[Any]]:
        """Return some columns in one pass over the file, without reading any other."""
        self._read([self._field(name) for name in names if name not in self._columns])
        return [self._columns[name] for name in names]

    def _field(self, name: str) -> Field:
        for one in self.channel.fields:
            if one.name == name:
                return one
        raise MissingColumn(
            f"{self.channel.topic!r} has no column {name!r}; it has {', '.join(self.names)}"
        )

    def _read(self, fields: Sequence[Field]) -> None:
        self._source.read({self.channel.topic: [one.name for one in fields]})

    def _keep(self, times: list[NDArray[np.uint64]], parts: dict[str, list[NDArray[Any]]]) -> None:
        self._times_ns = np.concatenate(times) if times else np.zeros(0, dtype=np.uint64)
        for name in list(parts):
            self._columns[name] = self._joined(parts.pop(name), self._field(name))

    def _part(self, rows: list[Row], one: Field) -> NDArray[Any]:
        values = [row[one.name] for row in rows]
        if one.type == "string":
            return np.array(values, dtype=object)
        if one.type not in ("numbers", "integers"):
            return np.array(values, dtype=np.float64)
        width = max((len(value) for value in values if value is not None), default=0)
        if width > CELLS_PER_ROW_MAX:
            raise RecordingError(
                f"{self._source.path}: a row of the topic {self.channel.topic!r} has {width} values "
                f"in its field {one.name!r}, at most {CELLS_PER_ROW_MAX} are read."
            )
        if width and all(value is not None and len(value) == width for value in values):
            return np.array(values, dtype=np.float64)
        self._check_cells(one, width, len(values), sum(len(value) for value in values if value))
        part = np.full((len(values), width), np.nan)  # some rows are null or shorter than others
        for index, value in enumerate(values):
            if value:
                part[index, : len(value)] = value
        return part

    def _joined(self, parts: list[NDArray[Any]], one: Field) -> NDArray[Any]:
        if one.type not in ("numbers", "integers"):
            return np.concatenate(parts) if parts else np.zeros(0)
        width = max((part.shape[1] for part in parts), default=0)
        self._check_cells(one, width, self._count, sum(part.size for part in parts))
        whole = np.full((sum(len(part) for part in parts), width), np.nan)
        at = 0
        for part in parts:
            whole[at : at + len(part), : part.shape[1]] = part
            at += len(part)
        return whole

    def _check_cells(self, one: Field, width: int, rows: int, items: int) -> None:
        """All lists of a recorded field have one length; single long ones would ask for much memory."""
        if width > 16 and width * rows > 4 * items + (1 << 20):
            raise RecordingError(
                f"{self._source.path}: the lists in the field {one.name!r} of the topic "
                f"{self.channel.topic!r} have up to {width} values, and most far fewer. tenbaud writes "
                "no such field: the file was changed, or another program wrote it."
            )


class Filling:
    """Some columns of a table, from its rows as a pass over the file brings them."""

    def __init__(self, table: Table, names: Sequence[str]) -> None:
        self._table = table
        self._fields = [table._field(name) for name in names]
        self._parts: dict[str, list[NDArray[Any]]] = {name: [] for name in names}
        self._times: list[NDArray[np.uint64]] = []

    def add(self, times_ns: list[int], rows: list[Row]) -> None:
        self._times.append(np.array(times_ns, dtype=np.uint64))
        for one in self._fields:
            self._parts[one.name].append(self._table._part(rows, one))

    def finish(self) -> None:
        """Hand the columns to the table."""
        self._table._keep(self._times, self._parts)


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
