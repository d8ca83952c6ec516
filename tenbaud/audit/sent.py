"""Sent symbols: at most one a slot, each within its slot, and those of the words sent."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable
from itertools import pairwise
from typing import Any

from channel.codec.codec import Alphabet, Word
from channel.line.line import bits_per_symbol
from tenbaud.audit.base import Evidence, claim


@claim("each end recorded its symbols")
def check_recorded(evidence: Evidence) -> None:
    """Each end recorded the symbol of each slot, and the start of its samples."""
    for end in evidence.rows:
        if not evidence.topic(end, "symbol").recorded:
            evidence.at(end, "symbol", "every slot").gap("", "no symbols were recorded")
        if evidence.topic(end, "sample").rows and not evidence.topic(end, "epoch").rows:
            evidence.at(end, "epoch", "first epoch").gap("", "no epochs were recorded")


SENDS = (("transmitter", "symbol"), ("receiver", "down_symbol"))
"""Who sends symbols in slots, and the topic of those that it offered to the line."""


@claim("one symbol a slot, while it lasts", *((*where, "slot", "symbol", "left_ns") for where in SENDS))
def check_slots(evidence: Evidence) -> None:
    """At most one symbol a slot, in the order of slots, each while its slot lasts."""
    terms = evidence.terms
    _check_slots(evidence, SENDS[0], terms.slot_ns, len(evidence.alphabet.symbols), set())
    if terms.is_narrow:
        _check_slots(evidence, SENDS[1], terms.down_grid.slot_ns, 2, _slots_of_first_words(evidence))


def _slots_of_first_words(evidence: Evidence) -> set[int]:
    """Return the down slots up to the first symbol of each epoch.

    Until it comes the receiver assumes when the slots are, and a down symbol may find its slot begun.
    """
    terms, found = evidence.terms, set[int]()
    taken = sorted(row.slot for row in evidence.topic("receiver", "symbol") if row.taken)
    for epoch in evidence.topic("receiver", "epoch"):
        place = bisect_left(taken, epoch.sample * terms.symbols_per_word)
        if place < len(taken):
            after = taken[place] // terms.symbols_per_word + 1
            found |= set(range(epoch.sample * terms.down_symbols, after * terms.down_symbols))
    return found


def _check_slots(
    evidence: Evidence,
    where: tuple[str, str],
    slot_ns: Callable[[int], int],
    symbols: int,
    may_be_begun: set[int],
) -> None:
    before: Any = None
    for place, row in evidence.each(*where):
        if not 0 <= row.symbol < symbols:
            place.leak("symbol", "it is not in the coder's alphabet", f"{row.symbol}")
        if row.left_ns is None:
            continue
        if before is not None and row.slot == before.slot:
            place.leak("slot", "two symbols left in this slot")
        elif before is not None and row.slot < before.slot:
            place.leak("slot", "it is out of order", f"after slot {before.slot}")
        before = row
        begins, ends = slot_ns(row.slot), slot_ns(row.slot + 1)
        if row.left_ns < begins:
            early = f"{(begins - row.left_ns) / 1e6:.3f} ms too early"
            place.leak("left_ns", "it left before its slot began", early)
        elif row.left_ns >= ends:
            late = f"{(row.left_ns - ends) / 1e6:.3f} ms too late"
            place.leak("left_ns", "it left when its slot was over", late)
        elif evidence.is_virtual and row.left_ns != begins and row.slot not in may_be_begun:
            place.leak("left_ns", "on the virtual clock a symbol leaves as its slot begins")


@claim("bytes of a symbol", *((*where, "wire_bytes") for where in SENDS))
def check_bytes(evidence: Evidence) -> None:
    """All symbols that left took as many bytes on the line, those that did not took none."""
    for where in SENDS:
        sizes = [row.wire_bytes for row in evidence.topic(*where) if row.left_ns is not None]
        usual = max(set(sizes), key=sizes.count) if sizes else 0
        for place, row in evidence.each(*where):
            wanted = 0 if row.left_ns is None else usual
            if row.wire_bytes != wanted or (row.left_ns is not None and row.wire_bytes < 1):
                detail = f"{row.wire_bytes}, not {wanted}"
                place.leak("wire_bytes", "this is not a symbol's size", detail)


@claim(
    "words sent are the symbols that left",
    ("transmitter", "sample", "word_sent"),
    ("transmitter", "symbol", "slot", "symbol"),
)
def check_words_sent(evidence: Evidence) -> None:
    """The symbols of each word that was sent were offered to the uplink, and no others."""
    rows = evidence.topic("transmitter", "symbol")
    if not rows.recorded:
        return
    count = evidence.terms.symbols_per_word
    offered: dict[int, int] = {row.slot: row.symbol for row in rows}
    last_of_epoch = _last_samples(evidence)
    for place, row in evidence.each("transmitter", "sample"):
        word = _numbers(row.word_sent, evidence.alphabet)
        for index in range(count):
            slot = row.sample * count + index
            wanted = None if word is None or index >= len(word) else word[index]
            found = offered.get(slot)
            # The symbols still waiting for their slots are dropped when an epoch or the flight ends.
            waiting = found is None and index > 0 and row.sample in last_of_epoch
            if found != wanted and not waiting:
                detail = f"slot {slot}: {wanted}, {found} left"
                place.leak("word_sent", "these are not the symbols that left", detail)
        if word is not None and len(word) != count:
            place.leak("word_sent", "this is no word of the coder", f"{row.word_sent}")


@claim("the summary's coder bits", ("transmitter", "symbol", "slot", "left_ns"))
def check_coder_bits(evidence: Evidence) -> None:
    """The summary claims the coder bits, and the refusals, that the recording shows."""
    rows = evidence.topic("transmitter", "symbol")
    if not evidence.is_whole("transmitter") or not rows.recorded:
        return
    left = sum(row.left_ns is not None for row in rows)
    shown = {
        "coder_bits_up": left * bits_per_symbol(evidence.alphabet),
        "symbols_refused": float(len(rows) - left),
    }
    for name, value in shown.items():
        said = evidence.summary("transmitter").get(name)
        if said is not None and abs(said - value) > 1e-6 * max(1.0, value):
            place = evidence.at("transmitter", "symbol", "every slot")
            place.leak("", f"the summary's {name} is another", f"{said:g} said, {value:g} recorded")


def _last_samples(evidence: Evidence) -> set[int]:
    """Return the last sample that the transmitter confirmed of each epoch."""
    samples = [row.sample for row in evidence.topic("transmitter", "sample")]
    starts = {row.sample for row in evidence.topic("transmitter", "epoch")}
    before = [one for one, following in pairwise(samples) if following in starts]
    return {*before, *samples[-1:]}


def _numbers(word: Word, alphabet: Alphabet) -> list[int | None] | None:
    """Return the numbers of a word's symbols; None for those that the coder does not have."""
    if word is None:
        return None
    symbols = list(alphabet.symbols)
    return [symbols.index(one) if one in symbols else None for one in word]
