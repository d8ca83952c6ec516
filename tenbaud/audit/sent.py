"""Symbols as they left: one a slot at most, each while its slot lasts, and those of the words sent."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

from channel.codec.words import Word
from channel.line.uplink import bits_per_symbol
from tenbaud.audit.base import Claim, Evidence, Findings, Place
from tenbaud.build.flight import Agreement


def symbol_place(end: str, slot: int, field: str = "") -> Place:
    """Return where the symbol of a slot stands."""
    return Place(end, "symbol", f"slot {slot}", field)


def check_recorded(evidence: Evidence, findings: Findings) -> None:
    """Each end recorded which symbol was in which slot, and what its samples start from."""
    for end in evidence.rows:
        if not evidence.topic(end, "symbol").recorded:
            findings.gap(Place(end, "symbol", "every slot"), "no symbols were recorded")
        if evidence.topic(end, "sample").rows and not evidence.topic(end, "epoch").rows:
            findings.gap(Place(end, "epoch", "first epoch"), "no epochs were recorded")


def check_slots(evidence: Evidence, findings: Findings) -> None:
    """At most one symbol a slot, in the order of slots, each while its slot lasts."""
    terms = evidence.agreement.terms
    kinds = len(evidence.agreement.codec.coder.alphabet.symbols)
    before: Any = None
    for row in evidence.topic("transmitter", "symbol"):
        place = symbol_place("transmitter", row.slot)
        if not 0 <= row.symbol < kinds:
            findings.leak(
                place._replace(field="symbol"), "it is not in the coder's alphabet", f"{row.symbol}"
            )
        if row.left_ns is None:
            continue
        if before is not None and row.slot == before.slot:
            findings.leak(place._replace(field="slot"), "two symbols left in this slot")
        elif before is not None and row.slot < before.slot:
            findings.leak(
                place._replace(field="slot"), "it is out of order", f"after slot {before.slot}"
            )
        before = row
        begins, ends = terms.slot_ns(row.slot), terms.slot_ns(row.slot + 1)
        late = place._replace(field="left_ns")
        if row.left_ns < begins:
            early_ms = (begins - row.left_ns) / 1e6
            findings.leak(late, "it left before its slot began", f"{early_ms:.3f} ms too early")
        elif row.left_ns >= ends:
            late_ms = (row.left_ns - ends) / 1e6
            findings.leak(late, "it left when its slot was over", f"{late_ms:.3f} ms too late")
        elif evidence.is_virtual and row.left_ns != begins:
            findings.leak(late, "on the virtual clock a symbol leaves as its slot begins")


def check_bytes(evidence: Evidence, findings: Findings) -> None:
    """All symbols that left took as many bytes on the line, those that did not took none."""
    rows = evidence.topic("transmitter", "symbol").rows
    sizes = [row.wire_bytes for row in rows if row.left_ns is not None]
    usual = max(set(sizes), key=sizes.count) if sizes else 0
    for row in rows:
        wanted = 0 if row.left_ns is None else usual
        if row.wire_bytes != wanted or (row.left_ns is not None and row.wire_bytes < 1):
            place = symbol_place("transmitter", row.slot, "wire_bytes")
            findings.leak(place, "this is not a symbol's size", f"{row.wire_bytes}, not {wanted}")


def check_words_sent(evidence: Evidence, findings: Findings) -> None:
    """The symbols of each word that was sent were offered to the uplink, and no others."""
    rows = evidence.topic("transmitter", "symbol")
    if not rows.recorded:
        return
    agreement = evidence.agreement
    count = agreement.terms.symbols_per_word
    offered: dict[int, int] = {row.slot: row.symbol for row in rows}
    last_of_epoch = _last_samples(evidence)
    for row in evidence.topic("transmitter", "sample"):
        word = _numbers(row.word_sent, agreement)
        place = Place("transmitter", "sample", f"sample {row.sample}", "word_sent")
        for index in range(count):
            slot = row.sample * count + index
            wanted = None if word is None or index >= len(word) else word[index]
            found = offered.get(slot)
            # The symbols still waiting for their slots are dropped when an epoch or the flight ends.
            waiting = found is None and index > 0 and row.sample in last_of_epoch
            if found != wanted and not waiting:
                findings.leak(
                    place, "these are not the symbols that left", f"slot {slot}: {wanted}, {found} left"
                )
        if word is not None and len(word) != count:
            findings.leak(place, "this is no word of the coder", f"{row.word_sent}")


def check_coder_bits(evidence: Evidence, findings: Findings) -> None:
    """The summary claims the coder bits, and the refusals, that the recording shows."""
    rows = evidence.topic("transmitter", "symbol")
    end = evidence.end("transmitter")
    if end is None or not end.complete or not rows.recorded:
        return
    summary = evidence.summary("transmitter")
    alphabet = evidence.agreement.codec.coder.alphabet
    left = sum(row.left_ns is not None for row in rows)
    shown = {
        "coder_bits_up": left * bits_per_symbol(alphabet),
        "symbols_refused": float(len(rows) - left),
    }
    for name, value in shown.items():
        said = summary.get(name)
        if said is not None and abs(said - value) > 1e-6 * max(1.0, value):
            findings.leak(
                Place("transmitter", "symbol", "every slot"),
                f"the summary's {name} is another",
                f"{said:g} said, {value:g} recorded",
            )


def _last_samples(evidence: Evidence) -> set[int]:
    """Return the last sample that the transmitter confirmed of each epoch."""
    samples = [row.sample for row in evidence.topic("transmitter", "sample")]
    starts = {row.sample for row in evidence.topic("transmitter", "epoch")}
    before = [one for one, following in pairwise(samples) if following in starts]
    return {*before, *samples[-1:]}


def _numbers(word: Word, agreement: Agreement) -> list[int | None] | None:
    """Return the numbers of a word's symbols; None for those that the coder does not have."""
    if word is None:
        return None
    symbols = list(agreement.codec.coder.alphabet.symbols)
    return [symbols.index(one) if one in symbols else None for one in word]


RECORDED = Claim("each end recorded its symbols", check_recorded, ())
SLOTS = Claim(
    "one symbol a slot, while it lasts",
    check_slots,
    (("transmitter", "symbol", ("slot", "symbol", "left_ns")),),
)
BYTES = Claim("bytes of a symbol", check_bytes, (("transmitter", "symbol", ("wire_bytes",)),))
WORDS_SENT = Claim(
    "words sent are the symbols that left",
    check_words_sent,
    (("transmitter", "sample", ("word_sent",)), ("transmitter", "symbol", ("slot", "symbol"))),
)
CODER_BITS = Claim(
    "the summary's coder bits", check_coder_bits, (("transmitter", "symbol", ("slot", "left_ns")),)
)
