"""Every recorded field that no claim of an audit verifies, with the reason.

Fields that are verified under some conditions only are owned by a claim and stand here too.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from tenbaud.audit.base import FILED, Evidence
from tenbaud.recording.kinds import KINDS

ORDER = "(order)"
"""The place of a row among the others of its topic, as if it were a field."""

Applies = Callable[[Any, Evidence], bool]


def _always(_row: Any, _evidence: Evidence) -> bool:
    return True


class Unclaimed(NamedTuple):
    """Fields of a topic that carry no claim, and why; `applies` tells for which rows."""

    end: str
    topic: str
    fields: tuple[str, ...]
    why: str
    applies: Applies = _always


def _all_fields(end: str, topic: str) -> tuple[str, ...]:
    return tuple(field.name for field in KINDS[end][topic].channel.fields)


UNCLAIMED: tuple[Unclaimed, ...] = (
    Unclaimed(
        "transmitter",
        "sample",
        ("lag_samples",),
        "when it was confirmed: no state depends on it",
    ),
    Unclaimed(
        "transmitter",
        "symbol",
        ("left_ns", FILED),
        "on a real clock only that it is within its slot",
        lambda _row, evidence: not evidence.is_virtual,
    ),
    Unclaimed(
        "transmitter",
        "symbol",
        (FILED, "slot", "symbol"),
        "of a symbol that was refused: it was never on the line; only how many there are counts",
        lambda row, _evidence: row.left_ns is None,
    ),
    Unclaimed(
        "transmitter",
        "symbol",
        ("symbol",),
        "of a word whose echo never came, on a line that flips symbols: nobody else knows it",
        lambda row, evidence: _is_unconfirmed(row, evidence),
    ),
    Unclaimed(
        "transmitter",
        "tick",
        ("lateness_ms",),
        "how late the loop was: no state depends on it",
        lambda _row, evidence: evidence.agreement.clock == "real",
    ),
    Unclaimed(
        "transmitter",
        "tick",
        ("measured", "true"),
        "what a rig says of itself; on a simulated one they must be within an encoder's step",
    ),
    Unclaimed(
        "transmitter",
        "tick",
        ("applied",),
        "what the rig says that was applied: a recorded flight, or a dry run",
        lambda _row, evidence: _is_told_by_rig(evidence),
    ),
    Unclaimed(
        "transmitter",
        "confirmed",
        ("doubt", "lag_samples"),
        "how sure the transmitter was, and when: no state depends on it",
    ),
    Unclaimed(
        "transmitter",
        "hypotheses",
        ("size", "rest", "best", "confirmed_to"),
        "what the transmitter took for possible; that it never goes back is all that can be shown",
    ),
    Unclaimed(
        "transmitter",
        "down_symbols",
        ("symbols", ORDER),
        "of a sample that was not confirmed, or of a lost symbol: no other row says what came",
        lambda row, evidence: _is_unheard(row, evidence),
    ),
    Unclaimed(
        "transmitter",
        "gap",
        _all_fields("transmitter", "gap")[1:],
        "a gauge for people, worked out afterwards; nothing rests on it",
    ),
    Unclaimed(
        "transmitter",
        "device",
        _all_fields("transmitter", "device")[1:],
        "what a real rig says of itself",
    ),
    Unclaimed(
        "transmitter",
        "event",
        _all_fields("transmitter", "event")[2:],
        "what an event says beyond its kind; where the confirmed copy stood is in the samples",
    ),
    Unclaimed(
        "transmitter",
        "event",
        (ORDER,),
        "a session stamps its events with the last tick that it measured, a guard with the present one",
    ),
    Unclaimed(
        "receiver",
        "event",
        _all_fields("receiver", "event")[3:],
        "what an event says beyond its kind and sample",
    ),
    Unclaimed(
        "transmitter",
        "event",
        ("kind", "time_s", FILED),
        "of what only an event tells: kinds are known ones, and the summary has the number of all rows",
        lambda row, _evidence: row.kind != "guard",
    ),
    Unclaimed(
        "receiver",
        "event",
        ("kind", ORDER),
        "of what only an event tells",
        lambda row, _evidence: row.kind not in ("started", "rejoin", "erased", "late_symbol", "desync"),
    ),
    Unclaimed(
        "receiver",
        "symbol",
        ("slot", "symbol", "arrived_ns", FILED),
        "of a symbol that came too late and was dropped: only their number and order count",
        lambda row, _evidence: not row.taken,
    ),
    Unclaimed(
        "receiver",
        "symbol",
        ("arrived_ns",),
        "of the symbols of a word but its last one: their order, and not before they could be there",
        lambda row, evidence: _is_within_word(row, evidence),
    ),
    Unclaimed(
        "receiver",
        "sample",
        ("arrival_s",),
        "of an erased word: when the receiver gave it up, after the one before it and before the next",
        lambda row, evidence: _is_given_up(row, evidence),
    ),
    Unclaimed(
        "transmitter",
        "assumed",
        (ORDER, *_all_fields("transmitter", "assumed"), FILED),
        "what a list that fitted nothing had followed; only its difference from the receiver's is read",
    ),
    *(
        Unclaimed(
            end,
            "lockstep_failure",
            _all_fields(end, "lockstep_failure"),
            "a flight with one fails in any case; what the two copies were is in the samples",
        )
        for end in ("transmitter", "receiver")
    ),
)
"""What an audit does not verify."""


def reason_for(end: str, topic: str, field: str, row: Any, evidence: Evidence) -> str | None:
    """Return why a field of a row carries no claim; None where it carries one."""
    for one in UNCLAIMED:
        if (one.end, one.topic) == (end, topic) and field in one.fields and one.applies(row, evidence):
            return one.why
    return None


def _is_unconfirmed(row: Any, evidence: Evidence) -> bool:
    count = evidence.agreement.terms.symbols_per_word
    confirmed = evidence.topic("transmitter", "sample").by_key()
    taken = any(one.slot == row.slot for one in evidence.topic("receiver", "symbol"))
    return row.slot // count not in confirmed and (not taken or bool(evidence.agreement.faults.up.flip))


def _is_unheard(row: Any, evidence: Evidence) -> bool:
    return row.sample not in evidence.topic("transmitter", "confirmed").by_key() or None in row.symbols


def _is_given_up(row: Any, evidence: Evidence) -> bool:
    count = evidence.agreement.terms.symbols_per_word
    last = (row.sample + 1) * count - 1
    return not any(one.taken and one.slot == last for one in evidence.topic("receiver", "symbol"))


def _is_within_word(row: Any, evidence: Evidence) -> bool:
    count = evidence.agreement.terms.symbols_per_word
    return bool(row.slot % count != count - 1)


def _is_told_by_rig(evidence: Evidence) -> bool:
    section = evidence.agreement.config.transmitter
    return section.rig == "replay" or section.dry_run
