"""Finds the slot of a symbol byte from its few counter bits and its time of arrival.

A byte of a serial line carries its slot modulo 8 or 4. The line's schedule says which slot is due now,
and of the slots with the right remainder the nearest one is meant. A byte that fits the schedule is
taken, one before its time is refused, one after its deadline is late. What is taken moves the schedule
only a little, so that a byte which noise has made cannot drag it along; but a row of `RIVALS` bytes
that fit each other and not the schedule replaces it.

The transmitter, to which down symbols come, knows the schedule: it counts from its own tick 0
(`expect`). At the receiver it is known before the first symbol from the handshake: tick 0 lies between
the end of the answer to its hello and `START_NS` later (`Link.start_ns`). A wrong guess anywhere here
is a wrong or an erased symbol, which the echo covers.
"""

from __future__ import annotations

from collections.abc import Iterable

from channel.protocol.frames import Frame, Hello, LocatedSymbol, ShortSymbol, Welcome
from channel.protocol.rivals import Rivals
from channel.protocol.terms import SlotGrid

START_NS = 250_000_000
"""The hello is answered, the welcome travels, the transmitter begins: all within this."""
START_SLACK_NS = 50_000_000

RIVAL_SLOTS = 0.25
EARLY_SLOTS = 0.5
LATE_SLOTS = 0.5
GAIN_MIN = 1.0 / 16.0


class SlotFinder:
    """Finds the slots of symbol bytes for one session."""

    def __init__(self, grid: SlotGrid) -> None:
        self._grid = grid
        self._slot_ns = grid.length_ns
        self._allowance = grid.allowance_ns / self._slot_ns
        self._greeted_ns = 0
        self._first_slot = 0
        self._ahead_ns = 0
        self._zero_ns: float | None = None
        """when slot 0 would have arrived, by the schedule"""
        self._taken = 0
        self._rivals = Rivals(self._slot_ns, max(RIVAL_SLOTS, self._allowance))
        self._incarnation: int | None = None
        """of the transmitter that flies"""

    def answered(self, hello: Hello, answers: Iterable[Frame], now_ns: int) -> None:
        """Note the session's answer to a hello, which is on the line until `now_ns`."""
        for answer in answers:
            is_other = self._zero_ns is None or hello.incarnation != self._incarnation
            if isinstance(answer, Welcome) and is_other:
                self._incarnation, self._zero_ns = hello.incarnation, None
                self._rivals.clear()
                ahead = answer.first_sample - hello.sample if hello.sample else 0
                self._first_slot = answer.first_sample * self._grid.slots
                self._ahead_ns = ahead * self._grid.sample_ns
        if self._zero_ns is None:
            self._greeted_ns = now_ns

    def expect(self, line_delay_ns: int = 0) -> None:
        """Take it as known that slots are due by the grid, delayed by up to this; for flight times."""
        self._zero_ns = self._grid.due_ns(0) + line_delay_ns // 2

    def find(self, symbol: ShortSymbol, expected: int, now_ns: int) -> LocatedSymbol:
        """Return a symbol byte that came at `now_ns` with its slot; `expected` is not settled yet."""
        if self._zero_ns is None:
            return self._first(symbol, now_ns)
        place = (now_ns - self._zero_ns) / self._slot_ns
        slot = _nearest(symbol, place)
        early = slot - place
        # Deadlines count from the last symbol, itself perhaps late by the allowance. A byte later than
        # this is one of a heap that waited while this process did not run.
        in_time = slot >= expected and -early <= max(LATE_SLOTS, 2.0 * self._allowance)
        if in_time and early <= max(EARLY_SLOTS, self._allowance):
            self._rivals.clear()
            self._taken += 1
            gain = max(GAIN_MIN, 1.0 / (1.0 + self._taken))
            self._zero_ns -= gain * early * self._slot_ns
            due_ns = round(self._zero_ns + slot * self._slot_ns)
            return _located(symbol, slot, True, (slot, max(now_ns, due_ns)))
        if self._rivals.complete(slot, now_ns):
            self._start(slot, now_ns)
            return _located(symbol, slot, slot >= expected, (slot, now_ns))
        return _located(symbol, None if early > 0.0 and slot >= expected else slot)

    def _first(self, symbol: ShortSymbol, now_ns: int) -> LocatedSymbol:
        since_ns = now_ns - self._greeted_ns - self._grid.delivery_ns - self._ahead_ns
        first = self._first_slot
        place = (since_ns - START_NS / 2) / self._slot_ns
        slot = _nearest(symbol, first + max(0.0, place))
        earliest = first + (since_ns - START_NS) / self._slot_ns - EARLY_SLOTS
        latest = first + (since_ns + START_SLACK_NS) / self._slot_ns + EARLY_SLOTS
        if not earliest <= slot <= latest:
            return _located(symbol, None)
        self._start(slot, now_ns)
        return _located(symbol, slot, True, (slot, now_ns))

    def _start(self, slot: int, now_ns: int) -> None:
        self._zero_ns = now_ns - slot * self._slot_ns
        self._taken = 0
        self._rivals.clear()


def _located(
    symbol: ShortSymbol, slot: int | None, in_time: bool = False, anchor: tuple[int, int] | None = None
) -> LocatedSymbol:
    return LocatedSymbol(symbol.number, slot, symbol.slot_low, in_time, anchor)


def _nearest(symbol: ShortSymbol, place: float) -> int:
    """Return the slot with the symbol's counter bits that is nearest to a place on the slot axis."""
    turns = round((place - symbol.slot_low) / symbol.slot_modulus)
    return symbol.slot_low + symbol.slot_modulus * max(0, turns)
