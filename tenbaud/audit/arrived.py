"""Received symbols: at most one a slot, not before their possible arrival, and those of the words."""

from __future__ import annotations

from tenbaud.audit.base import Evidence, claim

SLACK_S = 1.0
"""By how much a line may hold symbols up and then deliver them closely after each other."""


@claim(
    "one symbol a slot was taken, in order",
    ("receiver", "symbol", "slot", "symbol", "arrived_ns", "taken"),
)
def check_taken(evidence: Evidence) -> None:
    """One symbol a slot, in the order of slots and of time; whatever came late was late."""
    count = evidence.terms.symbols_per_word
    erased = {
        (row.sample + 1) * count - 1: row.arrival_s
        for row in evidence.topic("receiver", "sample")
        if row.word is None
    }
    settled = -1
    before_ns: int | None = None
    for place, row in evidence.each("receiver", "symbol"):
        if not 0 <= row.symbol < len(evidence.alphabet.symbols):
            place.leak("symbol", "it is not in the coder's alphabet", f"{row.symbol}")
        if before_ns is not None and row.arrived_ns < before_ns:
            place.leak("arrived_ns", "it came before the one before it")
        before_ns = row.arrived_ns
        in_time = not (row.slot in erased and erased[row.slot] <= row.arrived_ns / 1e9)
        if row.taken and row.slot == settled:
            place.leak("slot", "two symbols were taken in this slot")
        elif row.taken and row.slot < settled:
            place.leak("slot", "it was taken after a later one", f"{settled}")
        elif not row.taken and row.slot > settled and count == 1 and in_time:
            place.leak("taken", "it came in time and was not taken")
        settled = max(settled, row.slot) if row.taken else settled


@claim(
    "words consumed are the symbols of their slots",
    ("receiver", "symbol", "slot", "symbol", "taken"),
    ("receiver", "sample", "sample", "word"),
)
def check_words(evidence: Evidence) -> None:
    """Each word is the symbols taken in its slots, and an erased one lacks one of them."""
    rows, samples = evidence.topic("receiver", "symbol"), evidence.topic("receiver", "sample")
    if not rows.recorded and not any(row.word for row in samples):
        return
    count = evidence.alphabet.symbols_per_word
    found = {row.slot: row.symbol for row in rows if row.taken}
    for place, row in evidence.each("receiver", "sample"):
        slots = range(row.sample * count, (row.sample + 1) * count)
        lacking = next((slot for slot in slots if slot not in found), None)
        brought = None
        if lacking is None:
            brought = tuple(evidence.alphabet.symbol(found[slot]) for slot in slots)
        if row.word != brought:
            at = slots[0] if lacking is None else lacking
            detail = f"{row.word}; symbol, slot {at}: {brought and list(brought)}"
            place.leak("word", "it is not what its slots brought", detail)
    known = {row.sample for row in samples}
    last = max(known, default=-1)
    # Words that were begun and, as an epoch or the flight ended, not finished.
    begun = {slot // count for slot in found if (slot // count + 1) * count - 1 not in found}
    for sample in sorted({slot // count for slot in found} - known - begun):
        if evidence.is_whole("receiver") or sample < last:
            place = evidence.at("receiver", "sample", f"sample {sample}")
            place.gap("sample", "it is missing, but a symbol was accepted for it")


@claim(
    "words were decided when their slots were",
    ("receiver", "symbol", "arrived_ns"),
    ("receiver", "sample", "arrival_s"),
)
def check_times(evidence: Evidence) -> None:
    """A word is decided when its last symbol comes; words are decided one after another."""
    count = evidence.terms.symbols_per_word
    arrivals = {row.slot: row.arrived_ns for row in evidence.topic("receiver", "symbol") if row.taken}
    before_s: float | None = None
    for place, row in evidence.each("receiver", "sample"):
        last = (row.sample + 1) * count - 1
        if before_s is not None and row.arrival_s < before_s:
            place.leak("arrival_s", "it was decided before the one before it")
        before_s = row.arrival_s
        if last in arrivals and row.arrival_s != arrivals[last] / 1e9:
            detail = f"{row.arrival_s!r} s; symbol, slot {last}, field arrived_ns: {arrivals[last]}"
            place.leak("arrival_s", "its last symbol came at another time", detail)


@claim("what came had left", ("receiver", "symbol", "slot", "symbol", "arrived_ns"))
def check_origin(evidence: Evidence) -> None:
    """Every symbol that arrived was sent, unchanged, and did not arrive before the line allows."""
    agreement, terms = evidence.agreement, evidence.terms
    up = agreement.faults.up
    sent = evidence.topic("transmitter", "symbol")
    left = {row.slot: row for row in sent if row.left_ns is not None}
    known = sent.recorded and agreement.link.carries_slots
    last = None if evidence.is_whole("transmitter") else max(left, default=-1)
    first = min(left, default=0)
    flips = bool(up.flip or up.raw) or evidence.is_steered
    # Only there is the receiver's clock the flight's, and nothing else holds a symbol up.
    exact = evidence.is_virtual and not up.any and not evidence.is_steered
    for place, row in evidence.each("receiver", "symbol"):
        due_ns = terms.slot_ns(row.slot) + terms.symbol_delay_ns
        if evidence.is_virtual and row.arrived_ns < due_ns:
            place.leak("arrived_ns", "it came before the line could have delivered it")
        if not known or (last is not None and row.slot > last):
            continue
        origin = left.get(row.slot)
        if origin is None:
            # Another transmitter, before this one was started, may have sent the first ones.
            if row.slot >= first or not left:
                place.leak("slot", "it came and never left the transmitter")
            continue
        if row.symbol != origin.symbol and not flips:
            detail = f"{origin.symbol} left, {row.symbol} came"
            place.leak("symbol", "it left as another one", detail)
        if exact and row.arrived_ns != origin.left_ns + terms.symbol_delay_ns + terms.uplink_line_ns:
            place.leak("arrived_ns", "this line delivers at once")


@claim("no more came than the line carries")
def check_rate(evidence: Evidence) -> None:
    """No more symbols came than the line can carry in the time that they took."""
    times = [row.arrived_ns for row in evidence.topic("receiver", "symbol") if row.taken]
    if len(times) < 2:
        return
    rate_baud = evidence.terms.rate_baud
    span_s = (max(times) - min(times)) / 1e9
    allowed = rate_baud * (span_s + SLACK_S) + 1
    if len(times) > allowed:
        detail = f"{len(times)} in {span_s:.1f} s, and {rate_baud:g} baud carry {allowed:.0f}"
        place = evidence.at("receiver", "symbol", "every slot")
        place.leak("", "more came than the line carries", detail)
