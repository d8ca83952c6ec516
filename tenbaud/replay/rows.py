"""The rows of a recording as typed records, checked one by one as they are read.

A recording may come from anybody. So the types are those that the nodes write, not those that the file
says it has, and an error names topic, row and field of a row that does not fit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Generic, NamedTuple, TypeVar

from channel.codec.codec import Vector
from channel.codec.words import Word
from channel.protocol.audit_trail import ARRIVED_CHANNEL, EPOCH_CHANNEL, SENT_CHANNEL
from channel.protocol.events import EVENT_CHANNEL
from channel.protocol.lockstep import LOCKSTEP_CHANNEL
from channel.protocol.recording import Field, RecordChannel
from receiver.session import records as receiver_records
from tenbaud.recording.recover import RECOVERED_NOTE
from tenbaud.recording.table import Table, Tables
from transmitter.metrics.gap import GAP_CHANNEL
from transmitter.session import records as transmitter_records

KEY_MAX = 2**48
"""No flight has a tick, sample or slot beyond this."""

ANGLES = ("measured_rad", "true_rad")
"""A rig may read an angle that is no number, which a recording holds as null."""


class SentSymbol(NamedTuple):
    """A symbol that was offered to the uplink."""

    slot: int
    symbol: int
    left_ns: int | None
    wire_bytes: int


class ArrivedSymbol(NamedTuple):
    """A symbol that came."""

    slot: int
    symbol: int
    arrived_ns: int
    taken: bool


class EpochStart(NamedTuple):
    """The initial state of an epoch."""

    sample: int
    epoch: int
    state: Vector
    coder: Vector
    hold_volts: Vector


class EventRow(NamedTuple):
    """Something that was reported."""

    time_s: float
    kind: str
    sample: int | None
    tick: int | None
    slot: int | None
    session: int | None
    epoch: int | None
    cause: str | None
    state: str | None
    by_peer: bool | None
    axis: int | None
    number: int | None
    value: float | None
    limit: float | None
    missed_share: float | None
    overdue_share: float | None
    transmitter_digest: str | None
    receiver_digest: str | None
    detail: str | None


class LockstepFailure(NamedTuple):
    """Two copies that differ."""

    sample: int
    epoch: int
    digest: str
    peer_digest: str
    state: Vector | None
    coder: Vector | None
    peer_state: Vector | None
    peer_coder: Vector | None
    input_samples: tuple[int, ...]
    input_words: tuple[int, ...]


class PlantTick(NamedTuple):
    """A tick beside the plant."""

    tick: int
    time_s: float
    measured_rad: Vector
    true_rad: Vector | None
    commanded_volts: Vector | None
    applied_volts: Vector
    late: bool
    lateness_ms: float
    guard: str


class Estimate(NamedTuple):
    """The predicted estimate of a tick."""

    tick: int
    coded_state: Vector
    live_state: Vector | None


class ConfirmedSample(NamedTuple):
    """A sample at the transmitter."""

    sample: int
    word_sent: Word
    word: Word
    range: Vector
    state: Vector
    coder: Vector
    digest: str
    peer_digest: str
    lag_samples: int


class GaugeRow(NamedTuple):
    """The gap gauge at a sample."""

    sample: int
    strength_rad2_per_s3: float | None
    rms_over_floor: float | None
    ideal_bits: float | None


class DeviceRow(NamedTuple):
    """A real rig's report beside a reading."""

    tick: int
    counts: tuple[int, ...]
    device_s: float | None
    age_ms: float
    lost: int


class CommandTick(NamedTuple):
    """A command that the receiver decided."""

    tick: int
    reference_rad: float | None
    live_state: Vector
    command_volts: Vector


class ConsumedSample(NamedTuple):
    """A sample at the receiver."""

    sample: int
    word: Word
    range: Vector
    state: Vector
    coder: Vector
    digest: str
    arrival_s: float


class Kind(NamedTuple):
    """A topic of an end: its record, the channel that the node writes it through, what may be null."""

    record: type[Any]
    channel: RecordChannel
    nullable: frozenset[str] = frozenset()


_EPOCH = Kind(EpochStart, EPOCH_CHANNEL)
_EVENT = Kind(EventRow, EVENT_CHANNEL, frozenset(EventRow._fields[2:]))
_LOCKSTEP = Kind(
    LockstepFailure,
    LOCKSTEP_CHANNEL,
    frozenset({"state", "coder", "peer_state", "peer_coder"}),
)

KINDS: dict[str, dict[str, Kind]] = {
    "transmitter": {
        "symbol": Kind(SentSymbol, SENT_CHANNEL, frozenset({"left_ns"})),
        "epoch": _EPOCH,
        "event": _EVENT,
        "lockstep_failure": _LOCKSTEP,
        "tick": Kind(
            PlantTick,
            transmitter_records.TICK_CHANNEL,
            frozenset({"true_rad", "commanded_volts"}),
        ),
        "sample": Kind(
            ConfirmedSample, transmitter_records.SAMPLE_CHANNEL, frozenset({"word_sent", "word"})
        ),
        "estimate": Kind(Estimate, transmitter_records.ESTIMATE_CHANNEL, frozenset({"live_state"})),
        "gap": Kind(GaugeRow, GAP_CHANNEL, frozenset(GaugeRow._fields[1:])),
        "device": Kind(DeviceRow, transmitter_records.DEVICE_CHANNEL, frozenset({"device_s"})),
    },
    "receiver": {
        "symbol": Kind(ArrivedSymbol, ARRIVED_CHANNEL),
        "epoch": _EPOCH,
        "event": _EVENT,
        "lockstep_failure": _LOCKSTEP,
        "tick": Kind(CommandTick, receiver_records.TICK_CHANNEL, frozenset({"reference_rad"})),
        "sample": Kind(ConsumedSample, receiver_records.SAMPLE_CHANNEL, frozenset({"word"})),
    },
}
"""Every topic of each end. What is written elsewhere in a recording is no part of an audit."""

Record = TypeVar("Record", bound=tuple[Any, ...])


@dataclass(slots=True)
class Topic(Generic[Record]):
    """The rows of one topic in the order of the file, with the flight time that each is filed under."""

    recorded: bool = False
    """whether the recording has the topic at all"""
    rows: list[Record] = field(default_factory=list)
    times_ns: list[int] = field(default_factory=list)

    def __iter__(self) -> Any:
        return iter(self.rows)

    def __len__(self) -> int:
        return len(self.rows)

    def by_key(self) -> dict[int, Record]:
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
    topics: dict[str, Topic[Any]]
    misfits: list[Misfit]
    foreign: list[str]
    """topics that no node writes"""

    def topic(self, name: str) -> Topic[Any]:
        """Return a topic of this end, without rows where it was not recorded."""
        return self.topics[name]


def read_rows(end: str, tables: Tables) -> EndRows:
    """Return the rows of one end; those that do not fit are left out and listed as misfits."""
    misfits: list[Misfit] = []
    topics: dict[str, Topic[Any]] = {}
    for name, kind in KINDS[end].items():
        table = tables.topics.get(name)
        topics[name] = Topic() if table is None else _typed(name, kind, table, misfits)
    foreign = [name for name in tables.topics if name not in KINDS[end]]
    complete = bool(tables.end) and RECOVERED_NOTE not in tables.end
    return EndRows(end, complete, topics, misfits, foreign)


def _typed(name: str, kind: Kind, table: Table, misfits: list[Misfit]) -> Topic[Any]:
    topic: Topic[Any] = Topic(recorded=True)
    lacking = [one.name for one in kind.channel.fields if one.name not in table.names]
    if lacking:
        misfits.append(Misfit(name, "every row", lacking[0], "this field is not recorded"))
        return topic
    fields = kind.channel.fields
    make = kind.record._make
    times_ns = table.times_ns.tolist()
    rows = (row for block in table.blocks() for row in block)
    for index, (row, time_ns) in enumerate(zip(rows, times_ns, strict=True)):
        values = [_frozen(row.get(one.name)) for one in fields]
        wrong = next((one for one, value in zip(fields, values, strict=True)
                      if not _fits(value, one, kind.nullable)), None)  # fmt: skip
        if wrong is None and not _key_fits(values[0], fields[0]):
            wrong = fields[0]
        if wrong is not None:
            value = row.get(wrong.name)
            misfits.append(Misfit(name, f"row {index}", wrong.name, f"it holds {value!r:.60}"))
            continue
        topic.rows.append(make(values))
        topic.times_ns.append(time_ns)
    return topic


def _frozen(value: Any) -> Any:
    return tuple(value) if type(value) is list else value


def _fits(value: Any, one: Field, nullable: frozenset[str]) -> bool:
    if value is None:
        return one.name in nullable
    match one.type:
        case "integer":
            return type(value) is int
        case "number":
            return type(value) in (int, float)
        case "string":
            return type(value) is str
        case "boolean":
            return type(value) is bool
        case "integers":
            return type(value) is tuple and _all_of(value, int)
        case _:
            holes = one.name in ANGLES
            return type(value) is tuple and all(
                type(entry) in (int, float) or (holes and entry is None) for entry in value
            )


def _all_of(values: Sequence[Any], kind: type) -> bool:
    return all(type(value) is kind for value in values)


def _key_fits(key: Any, one: Field) -> bool:
    return one.type != "integer" or 0 <= key <= KEY_MAX
