"""The evidence of a claim, and its findings."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

from tenbaud.build.flight import Agreement
from tenbaud.replay.expected import Expected
from tenbaud.replay.record import Epoch, FlightRecord
from tenbaud.replay.refly import Reflown
from tenbaud.replay.rows import EndRows, Topic

FILED = "(time)"
"""The flight time that a row is filed under, as if it were a field of each topic."""


class Place(NamedTuple):
    """A place in the recordings."""

    end: str
    topic: str
    row: str
    """such as `sample 77`"""
    field: str = ""

    def __str__(self) -> str:
        where = f"{self.end}: {self.topic}, {self.row}"
        return f"{where}, field {self.field}" if self.field else where


class Findings:
    """The findings as text: one line for each kind of fault in a field, with its first place."""

    def __init__(self) -> None:
        self._first: dict[tuple[bool, str, str, str, str], str] = {}
        self._count: dict[tuple[bool, str, str, str, str], int] = {}

    def leak(self, place: Place, what: str, detail: str = "") -> None:
        """Tell of something wrong; `what` is the kind of fault, `detail` this one's numbers."""
        self._add(False, place, what, detail)

    def gap(self, place: Place, what: str, detail: str = "") -> None:
        """Tell of something that the recordings do not show."""
        self._add(True, place, what, detail)

    def _add(self, is_gap: bool, place: Place, what: str, detail: str) -> None:
        kind = (is_gap, place.end, place.topic, place.field, what)
        self._count[kind] = self._count.get(kind, 0) + 1
        if kind not in self._first:
            text = f"{what}: {detail}" if detail else what
            self._first[kind] = f"{place}: {text}"

    def _lines(self, is_gap: bool) -> list[str]:
        lines = []
        for kind, text in self._first.items():
            if kind[0] is is_gap:
                count = self._count[kind]
                lines.append(text if count == 1 else f"{text} (the first of {count})")
        return lines

    @property
    def leaks(self) -> list[str]:
        """The faults."""
        return self._lines(False)

    @property
    def gaps(self) -> list[str]:
        """The claims that could not be checked."""
        return self._lines(True)


@dataclass
class Evidence:
    """All that an audit has of a flight."""

    record: FlightRecord
    epochs: list[Epoch] = field(default_factory=list)
    flown: list[Reflown] = field(default_factory=list)
    """the flight, flown again from its words; empty where it cannot be"""
    steps: tuple[tuple[int, float], ...] = ()
    """set-points that are not the configuration's: (tick, angle)"""
    jittered_states: int = 0
    """states that were computed again with other arrival times"""
    expected: Expected | None = None
    """what the recordings must hold; None where it cannot be known"""

    @property
    def rows(self) -> dict[str, EndRows]:
        """The rows of each end that is here."""
        return self.record.rows

    @property
    def agreement(self) -> Agreement:
        """The agreement of both ends."""
        return self.record.agreement

    def end(self, name: str) -> EndRows | None:
        """Return the rows of an end, None if it is not here."""
        return self.rows.get(name)

    def topic(self, end: str, name: str) -> Topic:
        """Return a topic; without rows where it or the end was not recorded."""
        rows = self.rows.get(end)
        return Topic() if rows is None else rows.topic(name)

    def summary(self, end: str) -> dict[str, Any]:
        """Return the figures in the folder of an end."""
        return self.record.summaries.get(end, {})

    @cached_property
    def is_virtual(self) -> bool:
        """Whether both ends flew on one clock, the transmitter's virtual one."""
        return self.agreement.clock == "virtual" and not self.agreement.faults.bad_clock

    @cached_property
    def is_steered(self) -> bool:
        """Whether a person changed something in flight, according to the recordings."""
        return any(event.kind == "control" for end in self.rows for event in self.topic(end, "event"))


Check = Callable[[Evidence, Findings], None]


@dataclass(frozen=True, slots=True)
class Claim:
    """Something that a recording must show, and the fields that it rests on."""

    title: str
    check: Check
    owns: tuple[tuple[str, str, tuple[str, ...]], ...]
    """(end, topic, fields)"""

    @property
    def fields(self) -> set[tuple[str, str, str]]:
        """Each field that it verifies."""
        return {(end, topic, name) for end, topic, names in self.owns for name in names}


def is_same(one: object, other: object) -> bool:
    """Whether two values are equal to the last bit; 0.0 and -0.0 are not."""
    return one == other and repr(one) == repr(other)
