"""Rows in order, none twice, none missing between others, each filed under its own flight time."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from channel.protocol.terms import Terms
from tenbaud.audit.base import FILED, Claim, Evidence, Findings, Place
from tenbaud.replay.rows import KINDS

Filed = Callable[[Any, Terms], int | None]

KEYED = (
    ("transmitter", "tick"),
    ("transmitter", "estimate"),
    ("transmitter", "sample"),
    ("transmitter", "gap"),
    ("transmitter", "device"),
    ("receiver", "tick"),
    ("receiver", "sample"),
)
"""Topics whose rows have a key each; that of every row is larger than the one before."""


ONCE = ("started", "rejoin_asked", "rejoin", "ended", "erased", "desync", "guard")
"""Kinds of events of which no two are alike."""


def check_shape(evidence: Evidence, findings: Findings) -> None:
    """Every row has the fields that the node writes, of their types."""
    for end, rows in evidence.rows.items():
        for misfit in rows.misfits:
            place = Place(end, misfit.topic, misfit.row, misfit.field)
            findings.gap(place, "this is not what a node writes", misfit.text)
        for topic in rows.foreign:
            findings.gap(Place(end, topic, "every row"), "no node writes this topic")


def check_order(evidence: Evidence, findings: Findings) -> None:
    """Keys rise from row to row."""
    for end, topic in KEYED:
        key = KINDS[end][topic].channel.fields[0].name
        before: int | None = None
        for row in evidence.topic(end, topic):
            place = Place(end, topic, f"{key} {row[0]}", key)
            if before is not None and row[0] == before:
                findings.leak(place, "it is recorded twice")
            elif before is not None and row[0] < before:
                findings.leak(place, "it is out of order", f"after {before}")
            before = row[0]
    for end in evidence.rows:
        earlier: Any = None
        for event in evidence.topic(end, "event"):
            # The transmitter stamps some of its events with the last tick at which it measured.
            if end == "receiver" and earlier is not None and event.time_s < earlier.time_s:
                place = Place(end, "event", f"time {event.time_s:.3f} s", "time_s")
                findings.leak(place, "it is out of order", f"after {earlier.time_s:.3f} s")
            if earlier == event and event.kind in ONCE:
                findings.leak(Place(end, "event", f"time {event.time_s:.3f} s"), "it is recorded twice")
            earlier = event


def check_filed(evidence: Evidence, findings: Findings) -> None:
    """Each row is filed under the flight time that its key stands for."""
    terms = evidence.agreement.terms
    for end, topics in KINDS.items():
        for name, kind in topics.items():
            filed = FILED_UNDER[name]
            if end == "transmitter" and name == "symbol":
                filed = _departure
            topic = evidence.topic(end, name)
            for row, time_ns in zip(topic.rows, topic.times_ns, strict=True):
                due = filed(row, terms)
                # Times are unsigned in the file: what happens before tick 0 is filed at zero.
                early = name == "event" and row.time_s < 0.0
                exact = name != "event" or early or row.time_s == time_ns / 1e9
                if due is not None and (max(0, due) != time_ns or not exact):
                    place = Place(end, name, f"{kind.channel.fields[0].name} {row[0]}", FILED)
                    findings.leak(place, "it is filed under another time", f"{time_ns} ns, not {due}")


def _tick(row: Any, terms: Terms) -> int:
    return int(row[0]) * terms.tick_ns


def _sample(row: Any, terms: Terms) -> int:
    return int(row[0]) * terms.sample_ns


def _departure(row: Any, terms: Terms) -> int | None:
    # One that was refused is filed under when it was offered, which nothing else says.
    return None if row.left_ns is None else int(row.left_ns)


FILED_UNDER: dict[str, Filed] = {
    "tick": _tick,
    "estimate": _tick,
    "device": _tick,
    "sample": _sample,
    "gap": _sample,
    "epoch": _sample,
    "lockstep_failure": _sample,
    "symbol": lambda row, terms: terms.slot_ns(row.slot),
    "event": lambda row, _terms: round(row.time_s * 1e9),
}

_ALL = tuple((end, topic) for end, topics in KINDS.items() for topic in topics)

SHAPE = Claim("every row is as the nodes write it", check_shape, ())
ORDER = Claim(
    "rows in order, none twice",
    check_order,
    (
        *((end, topic, (KINDS[end][topic].channel.fields[0].name,)) for end, topic in KEYED),
        ("receiver", "event", ("time_s",)),
    ),
)
FILED_TIME = Claim(
    "rows filed under their flight time",
    check_filed,
    tuple((end, topic, (FILED,)) for end, topic in _ALL),
)
