"""Where two recordings first disagree, to the last bit.

Rows of a topic are joined on its first field (tick or sample) while both files stream by, so that
two long flights need no memory. Wall-clock fields and the topic `event` are left out: two runs of
one flight need not share them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from channel.protocol.recording import RecordChannel
from tenbaud.recording.errors import RecordingError
from tenbaud.recording.folder import RECEIVER_NAME, TRANSMITTER_NAME, RunFolder
from tenbaud.recording.reader import Recording
from tenbaud.recording.rows import Row

IGNORED_TOPIC = "event"
LOCKSTEP_TOPIC = "sample"
NO_FIELD = "(no such field)"
NO_ROW = "(no row)"

DifferenceKind = Literal["value", "missing row", "length"]
_KeyedRow = tuple[object, int, Row]


@dataclass(frozen=True, slots=True)
class Comparison:
    """Two files to compare; `lockstep`: the two ends of one flight, by what both recorded."""

    first: Path
    second: Path
    lockstep: bool


@dataclass(frozen=True, slots=True)
class Difference:
    """The first difference. `key` is the value of the field `key_name`: the tick or sample."""

    kind: DifferenceKind
    topic: str
    key_name: str
    key: object
    time_ns: int
    field: str
    first_value: object
    second_value: object
    first: Path
    second: Path

    def __str__(self) -> str:
        where = f"{self.key_name} {self.key} ({self.time_ns / 1e9:.3f} s), topic {self.topic!r}"
        if self.kind == "length":
            longer, shorter = self.first, self.second
            if self.first_value == NO_ROW:
                longer, shorter = shorter, longer
            return f"No value differs, but {shorter} ends before {where}, where {longer} goes on."
        if self.kind == "missing row":
            lacking = self.first if self.first_value == NO_ROW else self.second
            return f"First difference at {where}: the row is missing in {lacking}."
        return (
            f"First difference at {where}, field {self.field!r}:\n"
            f"  {self.first_value!r}  in {self.first}\n"
            f"  {self.second_value!r}  in {self.second}"
        )


def first_difference(first: Path, second: Path | None = None) -> Difference | None:
    """The earliest difference in flight time, or None if there is none.

    Two run folders: each end is compared with the same end. One run folder alone: its transmitter
    is compared with its receiver, on the fields of `sample` that both have. Two files are compared
    as they are. That one side ends earlier is reported only if nothing else differs.
    Raises RecordingError if there is nothing to compare.
    """
    found = [
        difference
        for comparison in files_to_compare(first, second)
        for difference in _compare_files(comparison)
    ]
    return min(found, key=lambda entry: (entry.kind == "length", entry.time_ns), default=None)


def files_to_compare(first: Path, second: Path | None = None) -> list[Comparison]:
    """Which files `first_difference` would open. Ends recorded in one folder only are left out."""
    if second is None:
        run = RunFolder(first)
        return [Comparison(run.transmitter, run.receiver, lockstep=True)]
    if first.is_dir() != second.is_dir():
        raise RecordingError(
            f"{first} and {second} cannot be compared: one is a folder, the other is not. "
            "Give two run folders or two recordings."
        )
    if not first.is_dir():
        ends = {first.name, second.name}
        return [Comparison(first, second, lockstep=ends == {TRANSMITTER_NAME, RECEIVER_NAME})]
    here = {path.name: path for path in RunFolder(first).recordings()}
    there = {path.name: path for path in RunFolder(second).recordings()}
    common = [Comparison(here[name], there[name], lockstep=False) for name in here if name in there]
    if common:
        return common
    if here and there:
        # Each machine kept its own end of the same flight.
        (own,), (other,) = here.values(), there.values()
        return [Comparison(own, other, lockstep=True)]
    raise RecordingError(
        f"{first if not here else second} holds no recording to compare. Give two run folders, "
        f"each with {TRANSMITTER_NAME} or {RECEIVER_NAME}."
    )


def _compare_files(comparison: Comparison) -> Iterator[Difference]:
    first, second = Recording(comparison.first), Recording(comparison.second)
    if comparison.lockstep:
        topics = [LOCKSTEP_TOPIC]
    else:
        topics = sorted((first.topics.keys() | second.topics.keys()) - {IGNORED_TOPIC})
    for topic in topics:
        # An end that recorded no sample at all cannot be checked, and `schema` says so.
        sides = [side for side in (first, second) if comparison.lockstep or topic in side.topics]
        channels = [side.schema(topic) for side in sides]
        fields = _fields(channels, comparison.lockstep)
        rejoined = comparison.lockstep and (_rejoined(first) or _rejoined(second))
        difference = _compare_topic(first, second, channels[0], fields, rejoined)
        if difference is not None:
            yield difference


def _fields(channels: list[RecordChannel], only_common: bool) -> list[str]:
    """The fields to compare, in the first channel's order."""
    timing = {field.name for channel in channels for field in channel.fields if field.timing}
    names = [[field.name for field in channel.fields] for channel in channels]
    if only_common:
        kept = [name for name in names[0] if name in names[-1]]
    else:
        kept = list(dict.fromkeys(name for listed in names for name in listed))
    return [name for name in kept if name not in timing]


def _rejoined(recording: Recording) -> bool:
    """Whether the ends began anew: samples flown by one end only belong to the pause before."""
    if IGNORED_TOPIC not in recording.topics:
        return False
    return any(row.get("kind") == "rejoin" for _, row in recording.rows(IGNORED_TOPIC))


def _compare_topic(
    first: Recording,
    second: Recording,
    channel: RecordChannel,
    fields: list[str],
    skip_missing: bool,
) -> Difference | None:
    key_name = channel.fields[0].name
    left, right = _keyed(first, channel, key_name), _keyed(second, channel, key_name)

    def difference(
        kind: DifferenceKind, at: _KeyedRow, field: str, values: tuple[object, object]
    ) -> Difference:
        where = (at[0], at[1], field, *values, first.path, second.path)
        return Difference(kind, channel.topic, key_name, *where)

    here, there = next(left, None), next(right, None)
    while here is not None and there is not None:
        if here[0] != there[0]:
            if skip_missing:
                if _before(there[0], here[0]):
                    there = next(right, None)
                else:
                    here = next(left, None)
                continue
            missing = (NO_ROW, "(a row)") if _before(there[0], here[0]) else ("(a row)", NO_ROW)
            at = there if missing[0] == NO_ROW else here
            return difference("missing row", at, key_name, missing)
        unlike = _unlike_field(here[2], there[2], fields)
        if unlike is not None:
            return difference("value", here, unlike[0], unlike[1:])
        here, there = next(left, None), next(right, None)
    if here is not None:
        return difference("length", here, key_name, ("(a row)", NO_ROW))
    if there is not None:
        return difference("length", there, key_name, (NO_ROW, "(a row)"))
    return None


def _keyed(recording: Recording, channel: RecordChannel, key_name: str) -> Iterator[_KeyedRow]:
    for time_ns, row in recording.rows(channel.topic):
        yield row.get(key_name), time_ns, row


def _before(one: object, other: object) -> bool:
    """Whether key `one` comes earlier; a key that is no number comes last."""
    if isinstance(one, int | float) and isinstance(other, int | float):
        return one < other
    return isinstance(one, int | float)


def _unlike_field(here: Row, there: Row, fields: list[str]) -> tuple[str, object, object] | None:
    for name in fields:
        one, other = here.get(name, NO_FIELD), there.get(name, NO_FIELD)
        if _same(one, other):
            continue
        if isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
            for index, (value, counterpart) in enumerate(zip(one, other, strict=True)):
                if not _same(value, counterpart):
                    return f"{name}[{index}]", value, counterpart
        return name, one, other
    return None


def _same(one: object, other: object) -> bool:
    # The text tells 0.0 from -0.0 and 1 from 1.0, which are equal as numbers but not as bits.
    return one == other and repr(one) == repr(other)
