"""Symbols as they came: one a slot at most, not before they could be there, and those of the words."""

from __future__ import annotations

from tenbaud.audit.base import Claim, Evidence, Findings, Place
from tenbaud.audit.sent import symbol_place

SLACK_S = 1.0
"""By how much a line may hold symbols up and then deliver them closely after each other."""


def check_taken(evidence: Evidence, findings: Findings) -> None:
    """One symbol a slot, in the order of slots and of time; whatever came late was late."""
    kinds = len(evidence.agreement.codec.coder.alphabet.symbols)
    count = evidence.agreement.terms.symbols_per_word
    erased = {
        (row.sample + 1) * count - 1: row.arrival_s
        for row in evidence.topic("receiver", "sample")
        if row.word is None
    }
    settled = -1
    before_ns: int | None = None
    for row in evidence.topic("receiver", "symbol"):
        place = symbol_place("receiver", row.slot)
        if not 0 <= row.symbol < kinds:
            findings.leak(
                place._replace(field="symbol"), "it is not in the coder's alphabet", f"{row.symbol}"
            )
        if before_ns is not None and row.arrived_ns < before_ns:
            findings.leak(place._replace(field="arrived_ns"), "it came before the one before it")
        before_ns = row.arrived_ns
        if row.taken and row.slot == settled:
            findings.leak(place._replace(field="slot"), "two symbols were taken in this slot")
        elif row.taken and row.slot < settled:
            findings.leak(place._replace(field="slot"), "it was taken after a later one", f"{settled}")
        elif (
            not row.taken
            and row.slot > settled
            and count == 1
            and not (row.slot in erased and erased[row.slot] <= row.arrived_ns / 1e9)
        ):
            findings.leak(place._replace(field="taken"), "it came in time and was not taken")
        settled = max(settled, row.slot) if row.taken else settled


def check_words(evidence: Evidence, findings: Findings) -> None:
    """Each word is the symbols taken in its slots, and an erased one lacks one of them."""
    rows = evidence.topic("receiver", "symbol")
    if not rows.recorded and not any(row.word for row in evidence.topic("receiver", "sample")):
        return
    alphabet = evidence.agreement.codec.coder.alphabet
    count = alphabet.symbols_per_word
    found = {row.slot: row.symbol for row in rows if row.taken}
    samples = evidence.topic("receiver", "sample")
    known = set()
    for row in samples:
        known.add(row.sample)
        slots = range(row.sample * count, (row.sample + 1) * count)
        lacking = next((slot for slot in slots if slot not in found), None)
        brought = None if lacking is not None else [alphabet.symbol(found[slot]) for slot in slots]
        if row.word != (None if brought is None else tuple(brought)):
            findings.leak(
                Place("receiver", "sample", f"sample {row.sample}", "word"),
                "it is not what its slots brought",
                f"{row.word}; symbol, slot {slots[0] if lacking is None else lacking}: {brought}",
            )
    last = max(known, default=-1)
    partial = _begun_words(evidence)
    complete = evidence.rows["receiver"].complete if "receiver" in evidence.rows else False
    for slot in sorted(found):
        sample = slot // count
        if sample not in known and sample not in partial and (complete or sample < last):
            findings.gap(
                Place("receiver", "sample", f"sample {sample}", "sample"),
                "it is missing, and a symbol was taken for it",
            )


def check_times(evidence: Evidence, findings: Findings) -> None:
    """A word is decided when its last symbol comes; words are decided one after another."""
    count = evidence.agreement.terms.symbols_per_word
    arrivals = {row.slot: row.arrived_ns for row in evidence.topic("receiver", "symbol") if row.taken}
    before_s: float | None = None
    for row in evidence.topic("receiver", "sample"):
        place = Place("receiver", "sample", f"sample {row.sample}", "arrival_s")
        last = (row.sample + 1) * count - 1
        if before_s is not None and row.arrival_s < before_s:
            findings.leak(place, "it was decided before the one before it")
        before_s = row.arrival_s
        if last in arrivals and row.arrival_s != arrivals[last] / 1e9:
            detail = f"{row.arrival_s!r} s; symbol, slot {last}, field arrived_ns: {arrivals[last]}"
            findings.leak(place, "its last symbol came at another time", detail)


def check_origin(evidence: Evidence, findings: Findings) -> None:
    """Every symbol that arrived was sent, unchanged, and did not arrive before the line allows."""
    agreement, terms = evidence.agreement, evidence.agreement.terms
    up = agreement.faults.up
    sent = evidence.topic("transmitter", "symbol")
    end = evidence.end("transmitter")
    left = {row.slot: row for row in sent if row.left_ns is not None}
    known = end is not None and sent.recorded and agreement.link.carries_slots
    last = None if end is not None and end.complete else max(left, default=-1)
    first = min(left, default=0)
    flips = bool(up.flip or up.raw) or evidence.is_steered
    # Only there is the receiver's clock the flight's, and nothing else holds a symbol up.
    exact = evidence.is_virtual and not up.any and not evidence.is_steered
    for row in evidence.topic("receiver", "symbol"):
        place = symbol_place("receiver", row.slot)
        due_ns = terms.slot_ns(row.slot) + terms.symbol_delay_ns
        if evidence.is_virtual and row.arrived_ns < due_ns:
            findings.leak(
                place._replace(field="arrived_ns"), "it came before the line could have delivered it"
            )
        if not known or (last is not None and row.slot > last):
            continue
        origin = left.get(row.slot)
        if origin is None:
            # Another transmitter, before this one was started, may have sent the first ones.
            if row.slot >= first or not left:
                findings.leak(place._replace(field="slot"), "it came and never left the transmitter")
            continue
        if row.symbol != origin.symbol and not flips:
            findings.leak(
                place._replace(field="symbol"),
                "it left as another one",
                f"{origin.symbol} left, {row.symbol} came",
            )
        if exact and row.arrived_ns != origin.left_ns + terms.symbol_delay_ns + terms.uplink_line_ns:
            findings.leak(place._replace(field="arrived_ns"), "this line delivers at once")


def check_rate(evidence: Evidence, findings: Findings) -> None:
    """No more symbols came than the line can carry in the time that they took."""
    times = [row.arrived_ns for row in evidence.topic("receiver", "symbol") if row.taken]
    if len(times) < 2:
        return
    rate_baud = evidence.agreement.terms.rate_baud
    span_s = (max(times) - min(times)) / 1e9
    allowed = rate_baud * (span_s + SLACK_S) + 1
    if len(times) > allowed:
        findings.leak(
            Place("receiver", "symbol", "every slot"),
            "more came than the line carries",
            f"{len(times)} in {span_s:.1f} s, and {rate_baud:g} baud carry {allowed:.0f}",
        )


def _begun_words(evidence: Evidence) -> set[int]:
    """Return the samples whose words were begun and, as an epoch or the flight ended, not finished."""
    count = evidence.agreement.terms.symbols_per_word
    taken = {row.slot for row in evidence.topic("receiver", "symbol") if row.taken}
    return {slot // count for slot in taken if (slot // count + 1) * count - 1 not in taken}


TAKEN = Claim(
    "one symbol a slot was taken, in order",
    check_taken,
    (("receiver", "symbol", ("slot", "symbol", "arrived_ns", "taken")),),
)
WORDS = Claim(
    "words consumed are the symbols of their slots",
    check_words,
    (("receiver", "symbol", ("slot", "symbol", "taken")), ("receiver", "sample", ("sample", "word"))),
)
TIMES = Claim(
    "words were decided when their slots were",
    check_times,
    (("receiver", "symbol", ("arrived_ns",)), ("receiver", "sample", ("arrival_s",))),
)
ORIGIN = Claim(
    "what came had left",
    check_origin,
    (("receiver", "symbol", ("slot", "symbol", "arrived_ns")),),
)
RATE = Claim("no more came than the line carries", check_rate, ())
