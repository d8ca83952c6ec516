"""Events against the rows that they report: epochs, erased slots, late symbols, differences."""

from __future__ import annotations

from channel.protocol.events import EventKind
from tenbaud.audit.base import Evidence, claim

KINDS = frozenset(str(kind) for kind in EventKind)


@claim(
    "events of known kinds",
    ("transmitter", "event", "kind"),
    ("receiver", "event", "kind", "time_s", "sample"),
)
def check_events(evidence: Evidence) -> None:
    """Each event is of a known kind; at the receiver, at the time of the sample that it belongs to."""
    sample_ns = evidence.terms.sample_ns
    for end in evidence.rows:
        for place, row in evidence.each(end, "event"):
            if row.kind not in KINDS:
                place.leak("kind", "there is no such kind", row.kind)
            if end == "receiver" and row.kind != EventKind.DESYNC:
                now_s = None if row.sample is None else row.sample * sample_ns / 1e9
                if row.time_s != now_s:
                    place.leak("sample", "its sample is at another time", f"{row.sample}")


@claim(
    "events as many as what they tell of",
    ("transmitter", "event", "kind"),
    ("receiver", "event", "kind"),
)
def check_counts(evidence: Evidence) -> None:
    """As many events of a kind as rows that they report."""
    for end in filter(evidence.is_whole, evidence.rows):
        for kinds, wanted in _wanted(evidence, end).items():
            found = sum(row.kind in kinds for row in evidence.topic(end, "event"))
            if found != wanted:
                detail = f"{found} events, {wanted} by the other rows"
                place = evidence.at(end, "event", f"kind {kinds[0]}")
                place.gap("kind", "the other rows tell of another number", detail)


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
    if evidence.terms.symbols_per_word == 1:
        taken = {row.slot for row in symbols if row.taken}
        samples = {row.sample for row in evidence.topic(end, "sample")}
        wanted["erased",] = len(samples - taken)
    if evidence.agreement.link.carries_slots:
        wanted["late_symbol",] = sum(not row.taken for row in symbols)
    return wanted


@claim(
    "differences are differences",
    ("transmitter", "lockstep_failure", "digest", "peer_digest"),
    ("receiver", "lockstep_failure", "digest", "peer_digest"),
)
def check_lockstep(evidence: Evidence) -> None:
    """Two copies that differ are written down as such; a sample that did not differ is not."""
    for end in evidence.rows:
        for place, row in evidence.each(end, "lockstep_failure"):
            if row.digest == row.peer_digest:
                place.leak("peer_digest", "the digests do not differ")
