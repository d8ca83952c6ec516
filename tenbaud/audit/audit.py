"""Checks from the recordings that a flight used only the symbols that it sent in slots.

Did each slot carry at most one symbol, on the grid? Do the states of both ends follow from symbols and
slots alone? Do the commands, the codec's other input, follow from the states, so that nothing came down
by them that had not gone up? Did both ends record the same flight, all of it? The table of claims
(`tenbaud/audit/table.py`) says what is checked. What cannot be shown counts as not shown, and fails.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from channel.errors import CodecDiverged, TenbaudError
from channel.line.line import bits_per_symbol
from receiver.controllers.base import Controller
from tenbaud.audit.base import Evidence, Place
from tenbaud.audit.table import CLAIMS
from tenbaud.recording.errors import RecordingError
from tenbaud.recording.notes import version_notes
from tenbaud.recording.recover import RECOVERED_NOTE
from tenbaud.replay.control import controller_of, recorded_commands, steps_by_hand
from tenbaud.replay.expected import expect
from tenbaud.replay.record import FlightRecord, epochs_of, load_record
from tenbaud.replay.refly import Reflown, flown_again
from tenbaud.replay.replay import compare
from tenbaud.replay.rows import Topic
from tenbaud.replay.walk import Walk


@dataclass(frozen=True, slots=True)
class Counted:
    """Counts from the recordings, not from the ends' own summaries."""

    symbols_sent: int | None
    symbols_refused: int | None
    bits_per_symbol: float
    slots: int | None
    """from the first symbol sent to the last one"""
    symbol_bytes: int | None
    symbols_taken: int | None
    symbols_late: int | None
    baud: float | None
    """symbols per second on the receiver's clock"""
    samples: int
    erased: int
    down_symbols: int | None
    """sent down a narrow downlink"""


def count(evidence: Evidence) -> Counted:
    """Count the traffic on the line."""
    sent = evidence.topic("transmitter", "symbol")
    arrived = evidence.topic("receiver", "symbol")
    paid = [row for row in sent if row.left_ns is not None] if sent.recorded else None
    taken = [row for row in arrived if row.taken] if arrived.recorded else None
    samples = evidence.topic(evidence.record.consumer, "sample")
    slots = None
    if paid:
        slots = max(row.slot for row in paid) - min(row.slot for row in paid) + 1
    return Counted(
        symbols_sent=None if paid is None else len(paid),
        symbols_refused=None if paid is None else len(sent) - len(paid),
        bits_per_symbol=bits_per_symbol(evidence.alphabet),
        slots=slots,
        symbol_bytes=None if paid is None else sum(row.wire_bytes for row in paid),
        symbols_taken=None if taken is None else len(taken),
        symbols_late=None if taken is None else len(arrived) - len(taken),
        baud=_baud(taken or []),
        samples=len(samples),
        erased=sum(row.word is None for row in samples),
        down_symbols=_left(evidence.topic("receiver", "down_symbol")),
    )


def _left(sent: Topic) -> int | None:
    return sum(row.left_ns is not None for row in sent) if sent.recorded else None


def _baud(taken: list[Any]) -> float | None:
    times = [row.arrived_ns for row in taken]
    span_ns = max(times) - min(times) if times else 0
    return (len(times) - 1) * 1e9 / span_ns if span_ns else None


@dataclass(slots=True)
class Audit:
    """The findings of an audit. `passed` needs no leak and no gap."""

    record: FlightRecord
    counted: Counted
    leaks: list[str] = field(default_factory=list)
    gaps: list[str] = field(default_factory=list)
    """unverified claims"""
    notes: list[str] = field(default_factory=list)
    digests_compared: int = 0
    jittered_states: int = 0
    """states of the flights with other arrival times"""
    rejoin_bytes: int = 0
    """of start states, which went down the link"""

    @property
    def passed(self) -> bool:
        """Whether the flight used its paid symbols alone."""
        return not self.leaks and not self.gaps


def audit(path: Path, other: Path | None = None, *, allow_code: bool = False) -> Audit:
    """Audit the run at `path`; `other` is the folder of the other machine, where each kept its end.

    `allow_code`: classes from outside that its configuration names may run.
    """
    return audit_record(load_record(path, other, allow_code=allow_code))


def audit_record(record: FlightRecord) -> Audit:
    """Audit the recordings of a flight."""
    evidence = Evidence(record)
    _fly(evidence)
    for claim in CLAIMS:
        claim.check(evidence)
    compared = compare(record, evidence.flown)[1]
    if not compared:
        _whole(evidence).gap("", "no state could be compared with a recorded one")
    codec = record.agreement.codec
    starts = [epoch.start for epoch in evidence.epochs]
    carried = [one for one in starts if one != codec.initial()._replace(sample=one.sample)]
    return Audit(
        record,
        count(evidence),
        evidence.findings.lines(is_gap=False),
        evidence.findings.lines(is_gap=True),
        _notes(record),
        compared,
        evidence.jittered_states,
        sum(len(codec.pack(start)) for start in carried),
    )


def _whole(evidence: Evidence) -> Place:
    return evidence.at("flight", "all topics", "all samples")


def _fly(evidence: Evidence) -> None:
    """Fly the flight again from its words, if these are all here, as well as that can be done."""
    record, whole = evidence.record, _whole(evidence)
    record.tables[record.consumer].topic("sample")  # or there is nothing to audit
    try:
        evidence.epochs = epochs_of(record)
    except RecordingError as error:
        whole.gap("", str(error))
        return
    try:
        evidence.steps = steps_by_hand(record)
        rebuilt: Controller | None = controller_of(record.agreement.config, evidence.steps)
    except (TenbaudError, ValueError) as error:
        rebuilt = None
        whole.gap("", "whether the commands follow from the states", str(error))
    flown = None if rebuilt is None else _flown(evidence, rebuilt)
    commands = recorded_commands(record)
    # With a narrow downlink the flight rests on its symbols alone already.
    is_narrow = record.agreement.two_way is not None
    if commands is not None and (flown is None or (compare(record, flown)[0] and not is_narrow)):
        # Which of the two is it? With the recorded commands only the codec is left.
        alone = _flown(evidence, commands)
        if flown is None:
            flown = alone
        elif alone is not None and not compare(record, alone)[0]:
            whole.leak(
                "",
                "given the recorded commands the states do follow from the symbols",
                "it is the controller that used something else than the states and the set-point",
            )
    if flown is None:
        whole.gap("", "the flight cannot be flown again from its symbols")
        return
    evidence.flown = flown
    evidence.expected = expect(record.agreement, evidence.epochs, flown)


def _flown(evidence: Evidence, controller: Controller) -> list[Reflown] | None:
    """Return the flight flown again, None where it leads to states that no codec has."""
    evidence.walk = Walk()
    try:
        return list(flown_again(evidence.agreement, controller, evidence.epochs, evidence.walk.first))
    except (CodecDiverged, OverflowError):
        return None


def _notes(record: FlightRecord) -> list[str]:
    notes = []
    if "transmitter" not in record.tables:
        notes.append("only the receiver's recording is here: when each symbol left is not shown")
    if "receiver" not in record.tables:
        notes.append("only the transmitter's recording is here: arrivals and their times are unknown")
    if "transmitter" in record.rows and not record.summaries.get("transmitter"):
        notes.append("there is no summary: the total number of sent symbols is unknown")
    for end, tables in record.tables.items():
        notes += version_notes(tables.path, tables.metadata)
        if not tables.end:
            notes.append(f"the {end}'s recording was cut: audited up to the cut")
        if RECOVERED_NOTE in tables.end:
            notes.append(f"the {end}'s recording was recovered: audited up to the cut")
    config = record.agreement.config
    for end, section in (("transmitter", config.transmitter), ("receiver", config.receiver)):
        if section.sabotage:
            notes.append(f"the {end} was sabotaged on purpose: {section.sabotage}")
    return notes
