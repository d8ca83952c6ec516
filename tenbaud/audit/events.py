"""Events against what they tell of: epochs, erased slots, late symbols, differences."""

from __future__ import annotations

from channel.protocol.events import EventKind
from tenbaud.audit.base import Claim, Evidence, Findings, Place

KINDS = frozenset(str(kind) for kind in EventKind)


def check_events(evidence: Evidence, findings: Findings) -> None:
    """Each event is of a known kind; at the receiver, at the time of the sample that it belongs to."""
    sample_ns = evidence.agreement.terms.sample_ns
    for end in evidence.rows:
        for row in evidence.topic(end, "event"):
            place = Place(end, "event", f"time {row.time_s:.3f} s")
            if row.kind not in KINDS:
                findings.leak(place._replace(field="kind"), "there is no such kind", row.kind)
            if end == "receiver" and row.kind != EventKind.DESYNC:
                now_s = None if row.sample is None else row.sample * sample_ns / 1e9
                if row.time_s != now_s:
                    findings.leak(
                        place._replace(field="sample"), "its sample is at another time", f"{row.sample}"
                    )


def check_counts(evidence: Evidence, findings: Findings) -> None:
    """As many events of a kind as there are rows of what they tell of."""
    for end, rows in evidence.rows.items():
        if not rows.complete:
            continue
        for kinds, wanted in _wanted(evidence, end).items():
            events = evidence.topic(end, "event")
            found = sum(row.kind in kinds for row in events)
            if found != wanted:
                findings.gap(
                    Place(end, "event", f"kind {kinds[0]}", "kind"),
                    "the other rows tell of another number",
                    f"{found} events, {wanted} by the other rows",
                )


def _wanted(evidence: Evidence, end: str) -> dict[tuple[str, ...], int]:
    """Return, for kinds of events, how many of them the other topics call for."""
    epochs = len(evidence.topic(end, "epoch"))
    failures = evidence.topic(end, "lockstep_failure")
    differences = len({(row.epoch, row.sample) for row in failures})
    wanted: dict[tuple[str, ...], int] = {("desync",): differences}
    if end == "transmitter":
        wanted["started",] = min(1, epochs)
        return wanted
    # A receiver starts once; every later epoch is a rejoin.
    wanted["started", "rejoin"] = epochs
    symbols = evidence.topic(end, "symbol")
    taken = {row.slot for row in symbols if row.taken}
    count = evidence.agreement.terms.symbols_per_word
    if count == 1:
        samples = {row.sample for row in evidence.topic(end, "sample")}
        wanted["erased",] = len(samples - taken)
    if evidence.agreement.link.carries_slots:
        wanted["late_symbol",] = sum(not row.taken for row in symbols)
    return wanted


EVENTS = Claim(
    "events of known kinds",
    check_events,
    (("transmitter", "event", ("kind",)), ("receiver", "event", ("kind", "time_s", "sample"))),
)
COUNTS = Claim(
    "events as many as what they tell of",
    check_counts,
    (("transmitter", "event", ("kind",)), ("receiver", "event", ("kind",))),
)
