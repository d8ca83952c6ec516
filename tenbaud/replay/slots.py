"""What went through the slots of the uplink, from the recordings of both ends."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from math import log2
from typing import Any

from channel.codec.words import Word
from channel.links.registry import link_kind
from tenbaud.build.flight import Agreement
from tenbaud.recording.table import Tables
from tenbaud.replay.record import FlightRecord

Row = dict[str, Any]
SLACK_S = 1.0
"""By how much a line may hold symbols up and then deliver them closely after each other."""


@dataclass(frozen=True, slots=True)
class Counted:
    """What was counted in the recordings, not what the ends said of themselves."""

    symbols_sent: int | None
    symbols_refused: int | None
    bits_per_symbol: float
    slots: int | None
    """from the first symbol sent to the last one"""
    symbol_bytes: int | None
    symbols_taken: int | None
    symbols_late: int | None
    baud: float | None
    """symbols per second on the receiver's clock"""
    samples: int
    erased: int


def check_slots(record: FlightRecord) -> tuple[list[str], list[str]]:
    """Return (leaks, gaps): what is wrong with the slots, and what the recordings do not show."""
    leaks: list[str] = []
    gaps: list[str] = []
    sent = _rows(record.transmitter, "symbol")
    taken = [row for row in _rows(record.receiver, "symbol") or [] if row["taken"]]
    for end, tables in record.ends():
        if "symbol" not in tables.topics:
            gaps.append(f"the {end}'s recording does not say which symbol was in which slot")
    if sent is not None:
        leaks += _check_sent(sent, record.agreement)
    if record.receiver is not None and "symbol" in record.receiver.topics:
        leaks += _check_taken(taken, record)
        leaks += _check_words(record.receiver, taken, record.agreement)
    if record.transmitter is not None and sent is not None:
        leaks += _check_words_sent(record.transmitter, sent, record.agreement)
    if sent is not None and taken and link_kind(record.agreement.config.link.kind).carries_slots:
        leaks += _check_origin(sent, taken)
    return leaks, gaps


def count(record: FlightRecord) -> Counted:
    """Count what went over the line."""
    sent = _rows(record.transmitter, "symbol")
    arrived = _rows(record.receiver, "symbol")
    paid = None if sent is None else [row for row in sent if row["left_ns"] is not None]
    taken = None if arrived is None else [row for row in arrived if row["taken"]]
    samples = record.consumer.topic("sample").rows
    slots = None
    if paid:
        slots = max(row["slot"] for row in paid) - min(row["slot"] for row in paid) + 1
    return Counted(
        symbols_sent=None if paid is None else len(paid),
        symbols_refused=None if sent is None or paid is None else len(sent) - len(paid),
        bits_per_symbol=log2(len(record.agreement.codec.coder.alphabet.symbols)),
        slots=slots,
        symbol_bytes=None if paid is None else sum(row["wire_bytes"] for row in paid),
        symbols_taken=None if taken is None else len(taken),
        symbols_late=None if arrived is None or taken is None else len(arrived) - len(taken),
        baud=_baud(taken or []),
        samples=len(samples),
        erased=sum(row["word"] is None for row in samples),
    )


def _rows(tables: Tables | None, topic: str) -> list[Row] | None:
    if tables is None or topic not in tables.topics:
        return None
    return tables.topics[topic].rows


def _check_sent(sent: list[Row], agreement: Agreement) -> list[str]:
    """At most one symbol a slot, and each while its slot lasts."""
    terms = agreement.terms
    paid = [row for row in sent if row["left_ns"] is not None]
    early = [row for row in paid if row["left_ns"] < terms.slot_ns(row["slot"])]
    late = [row for row in paid if row["left_ns"] >= terms.slot_ns(row["slot"] + 1)]
    return [
        *_doubled(paid, "sent"),
        *_told(
            early,
            "left before its slot began",
            lambda row: f"{(terms.slot_ns(row['slot']) - row['left_ns']) / 1e6:.3f} ms too early",
        ),
        *_told(
            late,
            "left when its slot was over",
            lambda row: f"{(row['left_ns'] - terms.slot_ns(row['slot'] + 1)) / 1e6:.3f} ms too late",
        ),
        *_foreign(paid, agreement),
    ]


def _check_taken(taken: list[Row], record: FlightRecord) -> list[str]:
    """The receiver took one symbol a slot, none before it could be there, and no more than R."""
    agreement = record.agreement
    terms = agreement.terms
    leaks = [*_doubled(taken, "taken by the receiver"), *_foreign(taken, agreement)]
    faults = agreement.faults
    if agreement.clock == "virtual" and not faults.bad_clock:
        # There the receiver's clock is the flight's.
        early = [
            row
            for row in taken
            if row["arrived_ns"] < terms.slot_ns(row["slot"]) + terms.symbol_delay_ns
        ]
        leaks += _told(early, "came before the line could have delivered it", lambda _row: "")
    if len(taken) > 1:
        times = [row["arrived_ns"] for row in taken]
        span_s = (max(times) - min(times)) / 1e9
        allowed = terms.rate_baud * (span_s + SLACK_S) + 1
        if len(taken) > allowed:
            leaks.append(
                f"the receiver took {len(taken)} symbols in {span_s:.1f} s, and {terms.rate_baud:g} "
                f"baud carry {allowed:.0f}"
            )
    return leaks


def _check_words(receiver: Tables, taken: list[Row], agreement: Agreement) -> list[str]:
    """Each word consumed is the symbols of its slots, and an erased one lacks one of them."""
    found = {row["slot"]: row["symbol"] for row in taken}
    wrong = []
    for row in receiver.topic("sample").rows:
        word = _word_of(row["word"])
        brought = _brought(found, row["sample"], agreement)
        if word != brought:
            wrong.append(f"sample {row['sample']} consumed {word}, its slots brought {brought}")
    return _first(wrong, "words that are not the symbols of their slots")


def _check_words_sent(transmitter: Tables, sent: list[Row], agreement: Agreement) -> list[str]:
    """Each word that the transmitter says it sent is the symbols that left, where all of them did."""
    left = {row["slot"]: row["symbol"] for row in sent if row["left_ns"] is not None}
    wrong = []
    for row in transmitter.topic("sample").rows:
        word = _word_of(row["word_sent"])
        brought = _brought(left, row["sample"], agreement)
        if word is not None and brought is not None and word != brought:
            wrong.append(f"sample {row['sample']} was to send {word}, {brought} left")
    return _first(wrong, "words that are not the symbols that left")


def _check_origin(sent: list[Row], taken: list[Row]) -> list[str]:
    left = {row["slot"] for row in sent if row["left_ns"] is not None}
    last = max(left, default=-1)
    # A transmitter's recording that was cut ends before the receiver's.
    strangers = [row for row in taken if row["slot"] not in left and row["slot"] <= last]
    return _told(strangers, "was taken by the receiver and never left the transmitter", lambda _row: "")


def _brought(found: dict[int, int], sample: int, agreement: Agreement) -> Word:
    """Return the word that a sample's slots hold; None where one of them is empty."""
    alphabet = agreement.codec.coder.alphabet
    first = sample * alphabet.symbols_per_word
    symbols = []
    for slot in range(first, first + alphabet.symbols_per_word):
        symbol = alphabet.symbol(found[slot]) if slot in found else None
        if symbol is None:
            return None
        symbols.append(symbol)
    return tuple(symbols)


def _word_of(recorded: list[int] | None) -> Word:
    return None if recorded is None else tuple(recorded)


def _doubled(rows: list[Row], what: str) -> list[str]:
    counts = Counter(row["slot"] for row in rows)
    doubled = [f"slot {slot}: {number} symbols {what}" for slot, number in counts.items() if number > 1]
    return _first(doubled, "slots with more than one symbol")


def _foreign(rows: list[Row], agreement: Agreement) -> list[str]:
    kinds = len(agreement.codec.coder.alphabet.symbols)
    foreign = [row for row in rows if not 0 <= row["symbol"] < kinds]
    return _told(foreign, "is not in the coder's alphabet", lambda row: f"number {row['symbol']}")


def _told(rows: list[Row], what: str, detail: Callable[[Row], str]) -> list[str]:
    texts = []
    for row in rows:
        more = detail(row)
        texts.append(f"the symbol of slot {row['slot']} {what}" + (f", {more}" if more else ""))
    return _first(texts, f"symbols of which each {what}")


def _first(texts: list[str], noun: str) -> list[str]:
    if not texts:
        return []
    return [texts[0] if len(texts) == 1 else f"{len(texts)} {noun}; the first: {texts[0]}"]


def _baud(taken: list[Row]) -> float | None:
    times = [row["arrived_ns"] for row in taken]
    span_ns = max(times) - min(times) if times else 0
    return (len(times) - 1) * 1e9 / span_ns if span_ns else None
