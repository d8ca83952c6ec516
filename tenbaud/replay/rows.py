"""The rows of a recording as typed records, checked one by one as they are read.

A recording may come from anybody. Types are checked when it is read (`tenbaud.recording.rows`); here
each topic must have the fields that its node writes, and null only where the node writes null. An
error names topic, row and field of a row that does not fit.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, NamedTuple

from channel.protocol.recording import Field
from tenbaud.recording.kinds import KINDS, Kind
from tenbaud.recording.reader import Recording
from tenbaud.recording.recover import RECOVERED_NOTE

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
    misfits: list[Misfit] = []
    topics: dict[str, Topic] = {}
    for name, kind in KINDS[end].items():
        table = tables.topics.get(name)
        topics[name] = Topic() if table is None else _typed(name, kind, tables, misfits)
    foreign = [name for name in tables.topics if name not in KINDS[end]]
    complete = bool(tables.end) and RECOVERED_NOTE not in tables.end
    return EndRows(end, complete, topics, misfits, foreign)


def _typed(name: str, kind: Kind, tables: Recording, misfits: list[Misfit]) -> Topic:
    topic, names = Topic(recorded=True), tables.topics[name].names
    lacking = [one.name for one in kind.channel.fields if one.name not in names]
    if lacking:
        misfits.append(Misfit(name, "every row", lacking[0], "this field is not recorded"))
        return topic
    fields = kind.channel.fields
    make = kind.record._make
    for index, (time_ns, row) in enumerate(tables.rows(name)):
        read = (row.get(one.name) for one in fields)
        values: list[Any] = [tuple(value) if type(value) is list else value for value in read]
        pairs = zip(fields, values, strict=True)
        wrong = next((one for one, value in pairs if not _fits(value, one, kind)), None)
        if wrong is None and fields[0].type == "integer" and not 0 <= values[0] <= KEY_MAX:
            wrong = fields[0]
        if wrong is not None:
            value = row.get(wrong.name)
            misfits.append(Misfit(name, f"row {index}", wrong.name, f"it holds {value!r:.60}"))
            continue
        topic.rows.append(make(values))
        topic.times_ns.append(time_ns)
    return topic


def _fits(value: Any, one: Field, kind: Kind) -> bool:
    """Return whether a value, whose type has been checked already, may be null or hold nulls."""
    if value is None:
        return one.name in kind.nullable
    is_list = one.type in ("numbers", "integers")
    return not is_list or (kind.channel.topic, one.name) in WITH_HOLES or None not in value
