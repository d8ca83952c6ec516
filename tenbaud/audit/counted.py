"""Counts of the uplink's slots, from the recordings of both ends."""

from __future__ import annotations

from dataclasses import dataclass
from math import log2
from typing import Any

from tenbaud.audit.base import Evidence


@dataclass(frozen=True, slots=True)
class Counted:
    """Counts of the recorded rows, independent of the summaries."""

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


def count(evidence: Evidence) -> Counted:
    """Count what went over the line."""
    sent = evidence.topic("transmitter", "symbol")
    arrived = evidence.topic("receiver", "symbol")
    paid = [row for row in sent if row.left_ns is not None] if sent.recorded else None
    taken = [row for row in arrived if row.taken] if arrived.recorded else None
    samples = evidence.topic("receiver" if evidence.end("receiver") else "transmitter", "sample")
    slots = None
    if paid:
        slots = max(row.slot for row in paid) - min(row.slot for row in paid) + 1
    return Counted(
        symbols_sent=None if paid is None else len(paid),
        symbols_refused=None if paid is None else len(sent) - len(paid),
        bits_per_symbol=log2(len(evidence.agreement.codec.coder.alphabet.symbols)),
        slots=slots,
        symbol_bytes=None if paid is None else sum(row.wire_bytes for row in paid),
        symbols_taken=None if taken is None else len(taken),
        symbols_late=None if taken is None else len(arrived) - len(taken),
        baud=_baud(taken or []),
        samples=len(samples),
        erased=sum(row.word is None for row in samples),
    )


def _baud(taken: list[Any]) -> float | None:
    times = [row.arrived_ns for row in taken]
    span_ns = max(times) - min(times) if times else 0
    return (len(times) - 1) * 1e9 / span_ns if span_ns else None
