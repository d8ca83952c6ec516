"""The result of comparing recordings: one of three verdicts, the first difference, missing data."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any, NamedTuple

from tenbaud.recording.rows import Row

NO_FIELD = "(no such field)"
MISSING_SHOWN = 8


class Verdict(StrEnum):
    """The verdict of a comparison."""

    EQUAL = "equal"
    """everything that both must hold is there and the same"""
    DIFFERENT = "different"
    """a value differs"""
    NOT_COMPARABLE = "not comparable"
    """no value differs, but something is missing, so a difference could be in it"""


@dataclass(frozen=True, slots=True)
class Difference:
    """A value that differs. `key` is the value of the field `key_name`: the tick or sample."""

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
        return (
            f"First difference at {where}, field {self.field!r}:\n"
            f"  {self.first_value!r}  in {self.first}\n"
            f"  {self.second_value!r}  in {self.second}"
        )


@dataclass(slots=True)
class Missing:
    """Rows that one file lacks and the other holds, one after another."""

    path: Path
    topic: str
    key_name: str
    first: object
    last: object
    rows: int = 1
    ends: bool = False
    """whether the file holds none of the topic's rows after them"""

    def __str__(self) -> str:
        what = f"topic {self.topic!r}, {self.key_name} {self.first}"
        if self.rows > 1:
            what += f" to {self.last}: {self.rows} rows"
        return f"{what} missing {'at the end of' if self.ends else 'in'} {self.path}"


class KeyedRow(NamedTuple):
    """A row of a topic, by its tick or sample."""

    key: Any
    time_ns: int
    row: Row
    epoch: tuple[object, object] = (0, 0)
    """number and first sample of its epoch"""


@dataclass(slots=True)
class Compared:
    """The outcome of a comparison."""

    rows: int = 0
    """that were compared"""
    differences: list[Difference] = field(default_factory=list)
    """the first of each topic and pair of files"""
    missing: list[Missing] = field(default_factory=list)
    faults: list[str] = field(default_factory=list)
    """other reasons for which a difference could be unseen"""
    notes: list[str] = field(default_factory=list)

    @property
    def difference(self) -> Difference | None:
        """The earliest difference in flight time, or None if no value differs."""
        return min(self.differences, key=lambda entry: entry.time_ns, default=None)

    @property
    def verdict(self) -> Verdict:
        if self.differences:
            return Verdict.DIFFERENT
        if self.missing or self.faults or not self.rows:
            return Verdict.NOT_COMPARABLE
        return Verdict.EQUAL

    def lacks(self, path: Path, topic: str, key_name: str, key: object) -> None:
        """Note a row that a file lacks; rows that follow each other make one entry."""
        last = self.missing[-1] if self.missing else None
        follows = last is not None and isinstance(last.last, int) and key == last.last + 1
        if last is not None and (last.path, last.topic) == (path, topic) and follows:
            last.last, last.rows = key, last.rows + 1
        else:
            self.missing.append(Missing(path, topic, key_name, key, key))

    def compare(
        self,
        where: tuple[str, str],
        here: KeyedRow,
        there: KeyedRow,
        fields: Sequence[str],
        paths: tuple[Path, Path],
    ) -> None:
        """Note the first difference of two rows, unless these files differ in the topic already.

        `where` is the topic and the name of its key.
        """
        if any((one.topic, one.first, one.second) == (where[0], *paths) for one in self.differences):
            return
        unlike = unlike_field(here.row, there.row, fields)
        if unlike is not None:
            at = (*where, here.key, here.time_ns)
            self.differences.append(Difference(*at, *unlike, *paths))

    def __str__(self) -> str:
        lines = [] if self.difference is None else [str(self.difference)]
        if self.verdict is Verdict.NOT_COMPARABLE:
            lines.append(f"Not comparable: no value differs in {self.rows} rows that both hold, but")
        lines += [f"  {fault}" for fault in self.faults]
        lines += [f"  {missing}" for missing in self.missing[:MISSING_SHOWN]]
        if len(self.missing) > MISSING_SHOWN:
            lines.append(f"  and {len(self.missing) - MISSING_SHOWN} more such stretches")
        if self.verdict is Verdict.NOT_COMPARABLE and not (self.missing or self.faults):
            lines.append("  there is no row that both hold")
        return "\n".join([*lines, *self.notes])


def paired(
    left: Iterator[KeyedRow], right: Iterator[KeyedRow]
) -> Iterator[tuple[KeyedRow | None, KeyedRow | None]]:
    """Walk two streams side by side; a row missing in one is paired with None."""
    here, there = next(left, None), next(right, None)
    while here is not None or there is not None:
        if here is not None and there is not None and here.key == there.key:
            yield here, there
            here, there = next(left, None), next(right, None)
        elif here is None or (there is not None and _is_before(there.key, here.key)):
            yield None, there
            there = next(right, None)
        else:
            yield here, None
            here = next(left, None)


def _is_before(one: object, other: object) -> bool:
    """Whether key `one` comes earlier; a key that is no number comes last."""
    if isinstance(one, int | float) and isinstance(other, int | float):
        return one < other
    return isinstance(one, int | float)


def unlike_field(here: Row, there: Row, fields: Sequence[str]) -> tuple[str, object, object] | None:
    """Return the first of these fields that differs, with its place in a list, and both values."""
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
