"""The evidence of a claim, and its findings."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

from channel.codec.codec import Alphabet
from channel.protocol.terms import Terms
from tenbaud.build.flight import Agreement
from tenbaud.replay.bits import is_same
from tenbaud.replay.expected import Expected
from tenbaud.replay.pack import Epoch
from tenbaud.replay.record import FlightRecord
from tenbaud.replay.refly import Reflown
from tenbaud.replay.rows import EndRows, Topic
from tenbaud.replay.walk import Walk

FILED = "(time)"
"""The flight time that a row is filed under, as if it were a field of each topic."""


class Findings:
    """The findings as text: one line for each kind of fault in a field, with its first place."""

    def __init__(self) -> None:
        self._first: dict[tuple[bool, str, str, str, str], str] = {}
        self._count: Counter[tuple[bool, str, str, str, str]] = Counter()

    def add(self, is_gap: bool, place: Place, field: str, what: str, detail: str) -> None:
        kind = (is_gap, place.end, place.topic, field, what)
        self._count[kind] += 1
        if kind not in self._first:
            where = f"{place.end}: {place.topic}, {place.row}" + (f", field {field}" if field else "")
            self._first[kind] = f"{where}: {what}: {detail}" if detail else f"{where}: {what}"

    def lines(self, is_gap: bool) -> list[str]:
        """Return the faults, or the claims that could not be checked."""
        return [
            text if self._count[kind] == 1 else f"{text} (the first of {self._count[kind]})"
            for kind, text in self._first.items()
            if kind[0] is is_gap
        ]


class Place(NamedTuple):
    """A row of the recordings, of which something may be found.

    `field` is empty for the row as a whole; `what` is the kind of fault, `detail` this one's numbers.
    """

    findings: Findings
    end: str
    topic: str
    row: str
    """such as `sample 77`"""

    def leak(self, field: str, what: str, detail: str = "") -> None:
        self.findings.add(False, self, field, what, detail)

    def gap(self, field: str, what: str, detail: str = "") -> None:
        """Note something that the recordings do not show."""
        self.findings.add(True, self, field, what, detail)

    def compare(self, names: tuple[str, ...], one: Any, other: Any, what: str, words: str) -> None:
        """Note the fields in which two rows differ; `words` is a form for both values."""
        for name in names:
            here, there = getattr(one, name), getattr(other, name)
            if not is_same(here, there):
                self.leak(name, what, words.format(here, there))


@dataclass
class Evidence:
    """The data of an audited flight, and the findings."""

    record: FlightRecord
    findings: Findings = field(default_factory=Findings)
    epochs: list[Epoch] = field(default_factory=list)
    flown: list[Reflown] = field(default_factory=list)
    """the flight, flown again from its words; empty where it cannot be"""
    walk: Walk = field(default_factory=Walk)
    """through that flight"""
    steps: tuple[tuple[int, float], ...] = ()
    """set-points that are not the configuration's: (tick, angle)"""
    jittered_states: int = 0
    """states of the flights with other arrival times"""
    expected: Expected | None = None
    """the expected content of the recordings; None if unknown"""

    @property
    def rows(self) -> dict[str, EndRows]:
        return self.record.rows

    @property
    def agreement(self) -> Agreement:
        return self.record.agreement

    @property
    def terms(self) -> Terms:
        return self.record.agreement.terms

    @property
    def alphabet(self) -> Alphabet:
        return self.record.agreement.codec.coder.alphabet

    def at(self, end: str, topic: str, row: str) -> Place:
        return Place(self.findings, end, topic, row)

    def topic(self, end: str, name: str) -> Topic:
        """Return a topic; without rows where it or the end was not recorded."""
        rows = self.rows.get(end)
        return Topic() if rows is None else rows.topics[name]

    def each(self, end: str, name: str) -> Iterator[tuple[Place, Any]]:
        for row in self.topic(end, name):
            yield self.at(end, name, _label(name, row)), row

    def is_whole(self, end: str) -> bool:
        return end in self.rows and self.rows[end].complete

    def summary(self, end: str) -> dict[str, Any]:
        """Return the figures in the folder of an end."""
        return self.record.summaries.get(end, {})

    @cached_property
    def doubted(self) -> set[int]:
        """Samples to whose state other inputs lead as well, so that the transmitter's may be others."""
        return {row.sample for row in self.topic("transmitter", "confirmed") if row.doubt}

    @cached_property
    def is_virtual(self) -> bool:
        """Whether both ends flew on one clock, the transmitter's virtual one."""
        return self.agreement.clock == "virtual" and not self.agreement.faults.bad_clock

    @cached_property
    def is_steered(self) -> bool:
        """Whether a person changed something in flight, according to the recordings."""
        return any(event.kind == "control" for end in self.rows for event in self.topic(end, "event"))


def _label(topic: str, row: Any) -> str:
    if topic == "event":
        return f"time {row.time_s:.3f} s"
    return f"epoch {row.epoch}" if topic == "epoch" else f"{row._fields[0]} {row[0]}"


Check = Callable[[Evidence], None]


@dataclass(frozen=True, slots=True)
class Claim:
    """Something that a recording must show, and the fields that it rests on."""

    title: str
    owns: tuple[tuple[str, ...], ...]
    """(end, topic, field, field ...)"""
    check: Check

    @property
    def fields(self) -> set[tuple[str, str, str]]:
        return {(end, topic, name) for end, topic, *names in self.owns for name in names}


def claim(title: str, *owns: tuple[str, ...]) -> Callable[[Check], Claim]:
    """Make a check a claim on fields, each given as (end, topic, field, field ...)."""
    return lambda check: Claim(title, owns, check)
