"""A narrow downlink: what its symbols were, and what the transmitter made of those that came."""

from __future__ import annotations

from collections import Counter
from typing import Any

from channel.errors import CodecDiverged, TenbaudError
from tenbaud.audit.base import Evidence, Place, claim
from tenbaud.audit.flights import jittered
from tenbaud.replay.control import controller_of

BOTH = "recorded {}, computed {}"
EPOCH = ("sample", "epoch", "state")
OWN = ("word", "symbols", "commands")


@claim(
    "both ends began the two-way state machine alike",
    ("transmitter", "two_way", *EPOCH),
    ("receiver", "two_way", *EPOCH),
)
def check_starts(evidence: Evidence) -> None:
    """Each epoch has the whole state that it starts from, the codec's part as the epoch says."""
    machine = evidence.agreement.two_way
    if machine is None:
        return
    theirs = {row[:2]: row.state for row in evidence.topic("receiver", "two_way")}
    for end in evidence.rows:
        rows = evidence.topic(end, "two_way").rows
        epochs = evidence.topic(end, "epoch").rows
        unlike = Counter(row[:2] for row in rows)
        unlike.subtract(row[:2] for row in epochs)
        for (sample, _), excess in unlike.items():
            if excess:
                place = evidence.at(end, "two_way", f"sample {sample}")
                place.gap("epoch", "it is missing" if excess < 0 else "the topic epoch has no such row")
        if any(unlike.values()):
            continue
        for (place, row), epoch in zip(evidence.each(end, "two_way"), epochs, strict=True):
            try:
                state = machine.unpack(bytes.fromhex(row.state))
            except ValueError as error:
                place.leak("state", "it is no state of this flight", str(error))
                continue
            if (state.codec[1:], state.hold) != ((epoch.state, epoch.coder), epoch.hold):
                place.leak("state", "it is not that of the topic epoch")
            if end == "transmitter" and theirs.get(row[:2], row.state) != row.state:
                place.leak("state", "the receiver recorded something else")


@claim(
    "down symbols of every sample",
    ("receiver", "down_symbols", "sample", "symbols"),
    ("receiver", "down_symbol", "slot", "symbol"),
)
def check_sent(evidence: Evidence) -> None:
    """The receiver's down symbols are one bit a slot, and its hash bits are those of its states."""
    if evidence.agreement.two_way is None or "receiver" not in evidence.rows:
        return
    computed = {one.sample: one.symbols for one in evidence.flown}
    found = evidence.topic("receiver", "down_symbols").by_key()
    for sample in sorted(row.sample for row in evidence.topic("receiver", "sample")):
        if sample not in found:
            evidence.at("receiver", "down_symbols", f"sample {sample}").gap("", "it is missing")
    for place, row in evidence.each("receiver", "down_symbols"):
        wanted = computed.get(row.sample)
        if wanted is None:
            place.gap("sample", "no sample that was recorded brings it")
        elif wanted != row.symbols:
            detail = BOTH.format(row.symbols, wanted)
            place.leak("symbols", "its hash bits are not those of the state", detail)
    _check_left(evidence, found)


def _check_left(evidence: Evidence, sent: dict[int, Any]) -> None:
    """The symbols of each sample were offered to the line, each in its slot, and no others."""
    count, left = evidence.terms.down_symbols, evidence.topic("receiver", "down_symbol")
    if not left.recorded:
        evidence.at("receiver", "down_symbol", "every slot").gap("", "no symbols were recorded")
        return
    slots = left.by_key()
    for place, row in evidence.each("receiver", "down_symbol"):
        symbols = () if row.slot // count not in sent else sent[row.slot // count].symbols
        if row.slot % count >= len(symbols) or symbols[row.slot % count] != row.symbol:
            place.leak("symbol", "this is not the symbol of the sample", f"{symbols}")
    # The symbols still waiting for their slots are dropped when an epoch or the flight ends.
    lasts = {row.sample - 1 for row in evidence.topic("receiver", "epoch")} | {max(sent, default=0)}
    for sample in sorted(sent.keys() - lasts):
        for slot in range(sample * count, (sample + 1) * count):
            if slot not in slots:
                evidence.at("receiver", "down_symbol", f"slot {slot}").gap("slot", "it is missing")


@claim(
    "down symbols follow from the states and the set-points", ("receiver", "down_symbols", "symbols")
)
def check_following(evidence: Evidence) -> None:
    """The receiver, flown again with its controller and other arrival times, sends the same symbols.

    Not where a person moved the set-point: then there was news that no configuration has.
    """
    agreement, flown = evidence.agreement, evidence.flown
    if agreement.two_way is None or not flown or evidence.steps:
        return
    try:
        again = jittered(evidence, controller_of(agreement.config), 0)
    except (CodecDiverged, TenbaudError, ValueError):
        return  # said where the flight was flown from its symbols
    for one, other in zip(flown, again, strict=False):
        if (one.symbols, one.digest) != (other.symbols, other.digest):
            place = evidence.at(evidence.record.consumer, "down_symbols", f"sample {one.sample}")
            what = "the controller gives others, for these states and set-points"
            place.leak("symbols", what, BOTH.format(one.symbols, other.symbols))
            return
    evidence.jittered_states += len(again)


@claim(
    "confirmed samples are those that the receiver flew",
    ("transmitter", "confirmed", "sample", *OWN),
    ("transmitter", "sample", "word"),
)
def check_confirmed(evidence: Evidence) -> None:
    """What the transmitter is certain of is what happened, where nothing else leads to that state."""
    if evidence.agreement.two_way is None or evidence.expected is None:
        return
    if "transmitter" not in evidence.rows:
        return
    samples = evidence.topic("transmitter", "sample").by_key()
    _same_keys(evidence, "confirmed", set(samples))
    for place, row in evidence.each("transmitter", "confirmed"):
        one = samples.get(row.sample)
        if one is not None and one.word != row.word:
            place.leak("word", "the topic sample has another", f"{row.word} and {one.word}")
        wanted = evidence.expected.confirmed.get(row.sample)
        if wanted is not None and row.sample not in evidence.doubted:
            place.compare(OWN, row, wanted, "it is not what the receiver's symbols give", BOTH)


@claim(
    "down symbols that came are those that were sent",
    ("transmitter", "down_symbols", "sample", "symbols"),
    ("transmitter", "hypotheses", "sample", "confirmed_to"),
)
def check_heard(evidence: Evidence) -> None:
    """Of each sample that was confirmed the symbols were heard, as they were sent but for flips."""
    if evidence.agreement.two_way is None or "transmitter" not in evidence.rows:
        return
    confirmed = evidence.topic("transmitter", "confirmed").by_key()
    heard = {row.sample for row in evidence.topic("transmitter", "down_symbols")}
    followed = set(evidence.topic("transmitter", "hypotheses").by_key())
    _same_keys(evidence, "hypotheses", heard | followed)
    for sample in sorted((confirmed.keys() | followed) - heard):
        place = evidence.at("transmitter", "down_symbols", f"sample {sample}")
        why = "confirmed" if sample in confirmed else "heard of"
        place.gap("", f"it is missing, and the sample was {why}")
    flips = evidence.agreement.faults.down.flip or evidence.agreement.faults.down.raw
    for place, row in evidence.each("transmitter", "down_symbols"):
        sent = confirmed.get(row.sample)
        if sent is None or flips:
            continue
        if len(row.symbols) != len(sent.symbols) or any(
            one not in (None, other) for one, other in zip(row.symbols, sent.symbols, strict=False)
        ):
            place.leak("symbols", "others were sent", f"{row.symbols}, sent {sent.symbols}")
    _check_certain(evidence)


def _check_certain(evidence: Evidence) -> None:
    """What was certain after a sample never goes back, and never beyond the sample."""
    before: Any = None
    starts = {row.sample for row in evidence.topic("transmitter", "two_way")}
    for place, row in evidence.each("transmitter", "hypotheses"):
        back = before is not None and row.confirmed_to < before.confirmed_to
        if (back and row.sample not in starts) or row.confirmed_to > row.sample + 1:
            since = f", after {before.confirmed_to} of sample {before.sample}" if before else ""
            place.leak("confirmed_to", "it cannot be", f"{row.confirmed_to}{since}")
        before = row


def _same_keys(evidence: Evidence, topic: str, wanted: set[int]) -> None:
    found = set(evidence.topic("transmitter", topic).by_key())
    for sample in sorted(wanted ^ found):
        place: Place = evidence.at("transmitter", topic, f"sample {sample}")
        place.gap("sample", "it is missing" if sample in wanted else "no other row tells of it")
