"""Rows in order, none twice, none missing between others, each filed under its own flight time."""

from __future__ import annotations

from typing import Any

from channel.protocol.terms import Terms
from tenbaud.audit.base import FILED, Evidence, claim
from tenbaud.recording.kinds import KINDS

KEYED = (
    ("transmitter", "tick"),
    ("transmitter", "estimate"),
    ("transmitter", "sample"),
    ("transmitter", "gap"),
    *(("transmitter", topic) for topic in ("down_symbols", "confirmed", "hypotheses")),
    ("transmitter", "device"),
    ("receiver", "tick"),
    ("receiver", "sample"),
    ("receiver", "down_symbols"),
)
"""Topics whose rows have a key each; that of every row is larger than the one before."""

ONCE = ("started", "rejoin_asked", "rejoin", "ended", "erased", "desync", "guard")
"""Kinds of events of which no two are alike."""


def _key_of(end: str, topic: str) -> str:
    return KINDS[end][topic].channel.fields[0].name


@claim("every row is as the nodes write it")
def check_shape(evidence: Evidence) -> None:
    """Every row has the fields that the node writes, of their types."""
    for end, rows in evidence.rows.items():
        for misfit in rows.misfits:
            place = evidence.at(end, misfit.topic, misfit.row)
            place.gap(misfit.field, "a node does not write this", misfit.text)
        for topic in rows.foreign:
            evidence.at(end, topic, "every row").gap("", "no node writes this topic")


@claim(
    "rows in order, none twice",
    *((end, topic, _key_of(end, topic)) for end, topic in KEYED),
    ("receiver", "event", "time_s"),
)
def check_order(evidence: Evidence) -> None:
    """Keys rise from row to row."""
    for end, topic in KEYED:
        key = _key_of(end, topic)
        before: int | None = None
        for place, row in evidence.each(end, topic):
            if before is not None and row[0] == before:
                place.leak(key, "it is recorded twice")
            elif before is not None and row[0] < before:
                place.leak(key, "it is out of order", f"after {before}")
            before = row[0]
    for end in evidence.rows:
        earlier: Any = None
        for place, event in evidence.each(end, "event"):
            # The transmitter stamps some of its events with the last tick at which it measured.
            if end == "receiver" and earlier is not None and event.time_s < earlier.time_s:
                place.leak("time_s", "it is out of order", f"after {earlier.time_s:.3f} s")
            if earlier == event and event.kind in ONCE:
                place.leak("", "it is recorded twice")
            earlier = event


@claim(
    "rows filed under their flight time",
    *((end, topic, FILED) for end, topics in KINDS.items() for topic in topics),
)
def check_filed(evidence: Evidence) -> None:
    """Each row is filed under the flight time that its key stands for."""
    for end, topics in KINDS.items():
        for name in topics:
            times_ns = evidence.topic(end, name).times_ns
            for (place, row), time_ns in zip(evidence.each(end, name), times_ns, strict=True):
                due = _filed_under(end, name, row, evidence.terms)
                # Times are unsigned in the file: what happens before tick 0 is filed at zero.
                early = name == "event" and row.time_s < 0.0
                exact = name != "event" or early or row.time_s == time_ns / 1e9
                if due is not None and (max(0, due) != time_ns or not exact):
                    place.leak(FILED, "it is filed under another time", f"{time_ns} ns, not {due}")


def _filed_under(end: str, topic: str, row: Any, terms: Terms) -> int | None:
    """Return the time of a row in ns; None for a refused symbol, of which nothing else says when."""
    match topic:
        case "tick" | "estimate" | "device":
            return int(row[0]) * terms.tick_ns
        case "symbol":
            if end == "receiver":
                return terms.slot_ns(row.slot)
            return None if row.left_ns is None else int(row.left_ns)
        case "down_symbol":
            return None if row.left_ns is None else int(row.left_ns)
        case "event":
            return round(float(row.time_s) * 1e9)
    return terms.sample_ns * int(row[0])
