"""Ticks whose command had not come: each is marked where the session was in flight."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Iterable
from typing import Any

from channel.protocol.events import EventKind
from tenbaud.audit.base import Evidence, claim

TICK = ("transmitter", "tick")
BEGINS = (EventKind.STARTED.value, EventKind.REJOIN.value)
ENDS = tuple(
    kind.value
    for kind in (EventKind.REJOIN_ASKED, EventKind.DESYNC, EventKind.REFUSED, EventKind.ENDED)
)
PASSING = ("ready", "holding")
"""States of the guard in which a tick without a command is late, if a command is owed."""


@claim(
    "each late command is marked",
    (*TICK, "commanded", "guard", "late"),
    ("transmitter", "event", "time_s", "kind"),
)
def check_late(evidence: Evidence) -> None:
    """A tick without a command is late if commands were owed at the tick before and nothing happened.

    They were owed if that tick was late, or if it had a command in an epoch that had begun.
    """
    tick_ns = evidence.terms.tick_ns
    # The guard's events follow from the ticks themselves.
    events = [row for row in evidence.topic("transmitter", "event") if row.kind != "guard"]
    times = sorted(round(row.time_s * 1e9) for row in events)
    epochs = _Epochs(events, evidence.terms.ticks_per_sample * tick_ns)
    before: Any = None
    for place, row in evidence.each(*TICK):
        since_ns, now_ns = (row.tick - 1) * tick_ns, row.tick * tick_ns
        follows = before is not None and before.tick == row.tick - 1
        if follows and _is_open(row) and before.guard in (*PASSING, "running"):
            is_quiet = bisect_left(times, since_ns) == bisect_right(times, now_ns)
            owed = before.late or (before.commanded is not None and epochs.fly_at(since_ns))
            if is_quiet and owed:
                place.leak("late", "its command had not come, and one was owed")
        before = row


def _is_open(row: Any) -> bool:
    return not row.late and row.commanded is None and row.guard in PASSING


class _Epochs:
    """When an epoch was in flight, as far as the transmitter's events say."""

    def __init__(self, events: Iterable[Any], sample_ns: int) -> None:
        self._times: list[int] = []
        self._begins: list[int | None] = []
        """flight time from which commands are owed; None: no epoch is in flight"""
        for row in sorted(events, key=lambda one: float(one.time_s)):
            if row.kind in BEGINS or row.kind in ENDS:
                known = row.kind in BEGINS and row.sample is not None
                self._times.append(round(row.time_s * 1e9))
                self._begins.append(row.sample * sample_ns if known else None)

    def fly_at(self, time_ns: int) -> bool:
        """Return whether an epoch was in flight before this flight time, and had begun."""
        place = bisect_left(self._times, time_ns)
        begins = self._begins[place - 1] if place else None
        return begins is not None and begins <= time_ns
