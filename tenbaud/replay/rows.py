"""The rows of a recording as typed records, checked one by one as they are read.

A recording may come from anybody. Types are checked when it is read (`tenbaud.recording.rows`); here
each topic must have the fields that its node writes, and null only where the node writes null. An
error names topic, row and field of a row that does not fit.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from channel.protocol.recording import Field
from tenbaud.recording.kinds import KINDS, Kind
from tenbaud.recording.reader import Recording
from tenbaud.recording.recover import RECOVERED_NOTE
from tenbaud.recording.rows import Row

KEY_MAX = 2**48
"""No flight has a tick, sample or slot beyond this."""

WITH_HOLES = (
    *(("tick", name) for name in ("measured", "true", "reference")),
    ("down_symbols", "symbols"),
)
"""Lists that may hold null: readings that are not valid, no set-point, erased symbols."""


@dataclass(slots=True)
class Topic:
    """The rows of one topic in the order of the file, with the flight time that each is filed under."""

    recorded: bool = False
    """whether the recording has the topic at all"""
    rows: list[Any] = field(default_factory=list)
    times_ns: list[int] = field(default_factory=list)

    def __iter__(self) -> Any:
        return iter(self.rows)

    def __len__(self) -> int:
        return len(self.rows)

    def by_key(self) -> dict[int, Any]:
        """Return the rows by their first field; of doubled ones the last."""
        return {row[0]: row for row in self.rows}


class Misfit(NamedTuple):
    """A row or a topic that is not as the nodes write it."""

    topic: str
    row: str
    field: str
    text: str


@dataclass(slots=True)
class EndRows:
    """All that one end recorded, typed."""

    end: str
    complete: bool
    """whether the recorder finished the file; else what there is ends at a cut"""
    topics: dict[str, Topic]
    """all of the end's, without rows where it was not recorded"""
    misfits: list[Misfit]
    foreign: list[str]
    """topics that no node writes"""


def read_rows(end: str, tables: Recording) -> EndRows:
    """Return the rows of one end; those that do not fit are left out and listed as misfits."""
    kinds = KINDS[end]
    typed = {
        name: _Typed(kind, tables.topics[name].names)
        for name, kind in kinds.items()
        if name in tables.topics
    }
    for block in tables.blocks([name for name, one in typed.items() if one.is_whole]):
        for name, (times_ns, rows) in block.items():
            typed[name].add(times_ns, rows)
    topics = {name: typed[name].topic if name in typed else Topic() for name in kinds}
    misfits = [misfit for one in typed.values() for misfit in one.misfits]
    foreign = [name for name in tables.topics if name not in kinds]
    complete = bool(tables.end) and RECOVERED_NOTE not in tables.end
    return EndRows(end, complete, topics, misfits, foreign)


class _Typed:
    """A topic, made of its rows as a pass over the file brings them."""

    def __init__(self, kind: Kind, names: Collection[str]) -> None:
        """`names` are the fields that the recording has."""
        self.topic = Topic(recorded=True)
        self.misfits: list[Misfit] = []
        self._kind = kind
        self._count = 0
        lacking = [one.name for one in kind.channel.fields if one.name not in names]
        self.is_whole = not lacking
        if lacking:
            self._miss("every row", lacking[0], "this field is not recorded")

    def add(self, times_ns: Sequence[int], rows: Sequence[Row]) -> None:
        """Add the next rows; those that do not fit become misfits."""
        kind = self._kind
        fields, make = kind.channel.fields, kind.record._make
        is_counted = fields[0].type == "integer"
        for index, (time_ns, row) in enumerate(zip(times_ns, rows, strict=True), self._count):
            read = [row.get(one.name) for one in fields]
            values: list[Any] = [tuple(value) if type(value) is list else value for value in read]
            pairs = zip(fields, values, strict=True)
            wrong = next((one for one, value in pairs if not _fits(value, one, kind)), None)
            if wrong is None and is_counted and not 0 <= values[0] <= KEY_MAX:
                wrong = fields[0]
            if wrong is not None:
                self._miss(f"row {index}", wrong.name, f"it holds {row.get(wrong.name)!r:.60}")
                continue
            self.topic.rows.append(make(values))
            self.topic.times_ns.append(time_ns)
        self._count += len(rows)

    def _miss(self, row: str, field: str, text: str) -> None:
        self.misfits.append(Misfit(self._kind.channel.topic, row, field, text))


def _fits(value: Any, one: Field, kind: Kind) -> bool:
    """Return whether a value, whose type has been checked already, may be null or hold nulls."""
    if value is None:
        return one.name in kind.nullable
    is_list = one.type in ("numbers", "integers")
    return not is_list or (kind.channel.topic, one.name) in WITH_HOLES or None not in value
