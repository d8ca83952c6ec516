"""The rows of a recording as typed records, checked one by one as they are read.

A recording may come from anybody. Types are checked when it is read (`tenbaud.recording.rows`); here
each topic must have the fields that its node writes, and null only where the node writes null. An
error names topic, row and field of a row that does not fit.
"""

from __future__ import annotations

from collections import namedtuple
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from channel.protocol.events import EVENT_CHANNEL
from channel.protocol.lockstep import LOCKSTEP_CHANNEL
from channel.protocol.recording import (
    ARRIVED_CHANNEL,
    DOWN_SENT_CHANNEL,
    DOWN_SYMBOLS_CHANNEL,
    EPOCH_CHANNEL,
    SENT_CHANNEL,
    TWO_WAY_CHANNEL,
    Field,
    RecordChannel,
)
from receiver.session import records as receiver
from tenbaud.recording.reader import Recording
from tenbaud.recording.recover import RECOVERED_NOTE
from transmitter.metrics.gap import GAP_CHANNEL
from transmitter.session import records as transmitter

KEY_MAX = 2**48
"""No flight has a tick, sample or slot beyond this."""

WITH_HOLES = (
    *(("tick", name) for name in ("measured", "true", "reference")),
    ("down_symbols", "symbols"),
)
"""Lists that may hold null: readings that are not valid, no set-point, erased symbols."""


class Kind(NamedTuple):
    """A topic of an end: the channel that the node writes it through, and what may be null in it."""

    channel: RecordChannel
    nullable: frozenset[str]
    record: type[Any]
    """a named tuple with the channel's fields"""


def _kind(channel: RecordChannel, *nullable: str) -> Kind:
    names = [one.name for one in channel.fields]
    return Kind(channel, frozenset(nullable), namedtuple("Record", names))


_EPOCH = _kind(EPOCH_CHANNEL)
_TWO_WAY = _kind(TWO_WAY_CHANNEL)
_EVENT = _kind(EVENT_CHANNEL, *(one.name for one in EVENT_CHANNEL.fields[2:]))
_LOCKSTEP = _kind(LOCKSTEP_CHANNEL, "state", "coder", "peer_state", "peer_coder")

KINDS: dict[str, dict[str, Kind]] = {
    "transmitter": {
        "symbol": _kind(SENT_CHANNEL, "left_ns"),
        "epoch": _EPOCH,
        "two_way": _TWO_WAY,
        "event": _EVENT,
        "lockstep_failure": _LOCKSTEP,
        "tick": _kind(transmitter.TICK_CHANNEL, "true", "commanded"),
        "sample": _kind(transmitter.SAMPLE_CHANNEL, "word_sent", "word", "about"),
        "estimate": _kind(transmitter.ESTIMATE_CHANNEL, "live_state"),
        "down_symbols": _kind(DOWN_SYMBOLS_CHANNEL),
        "confirmed": _kind(transmitter.CONFIRMED_CHANNEL, "word"),
        "hypotheses": _kind(transmitter.HYPOTHESES_CHANNEL),
        "assumed": _kind(transmitter.ASSUMED_CHANNEL, "word", "symbols"),
        "gap": _kind(GAP_CHANNEL, *(one.name for one in GAP_CHANNEL.fields[1:])),
        "device": _kind(transmitter.DEVICE_CHANNEL, "device_s"),
    },
    "receiver": {
        "symbol": _kind(ARRIVED_CHANNEL),
        "epoch": _EPOCH,
        "two_way": _TWO_WAY,
        "event": _EVENT,
        "lockstep_failure": _LOCKSTEP,
        "tick": _kind(receiver.TICK_CHANNEL),
        "sample": _kind(receiver.SAMPLE_CHANNEL, "word"),
        "down_symbols": _kind(DOWN_SYMBOLS_CHANNEL),
        "down_symbol": _kind(DOWN_SENT_CHANNEL, "left_ns"),
    },
}
"""Every topic of each end. What is written elsewhere in a recording is no part of an audit."""


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
