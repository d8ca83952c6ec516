"""The next slot that the receiver settles: on its symbol, on a later one, or at its deadline.

The receiver's session and the schedule of the studies count their slots with it.
"""

from __future__ import annotations

from collections.abc import Iterator

from channel.protocol.terms import Terms


class SlotClock:
    """Counts the slots of an epoch. What it yields is settled: nothing that comes later changes it."""

    def __init__(self, terms: Terms, slot: int = 0) -> None:
        self.slot = slot
        """the first one that is not settled"""
        self.silent_slots = 0
        """settled by their deadlines since the last symbol"""
        self._terms = terms
        self._gap_slots_max = terms.history_samples * terms.symbols_per_word
        self._anchor: tuple[int, int] | None = None

    @property
    def deadline_ns(self) -> int | None:
        """Return when the next slot is taken for erased; None: not by the clock."""
        if self._anchor is None:
            return None
        slot, time_ns = self._anchor
        due_ns = self._terms.slot_ns(self.slot) - self._terms.slot_ns(slot)
        return time_ns + due_ns + self._terms.deadline_allowance_ns

    @property
    def is_silent(self) -> bool:
        """Return whether nothing has come for so long that no slot is due by the clock any more."""
        return self.silent_slots >= self._gap_slots_max

    def bridges(self, slot: int) -> bool:
        """Return whether a slot is so near that what lies between is a gap and no other flight."""
        return abs(slot - self.slot) <= self._gap_slots_max

    def anchor(self, at: tuple[int, int] | None) -> None:
        """Count deadlines from this (slot, time), or from nothing any more."""
        self._anchor = at

    def take(self, slot: int) -> Iterator[int]:
        """Settle the slots before that of a symbol, yielding each, and then its own, unyielded."""
        self.silent_slots = 0
        while self.slot < slot:
            yield self._settle()
        self._settle()

    def expired(self, now_ns: int) -> Iterator[int]:
        """Settle the slots whose deadline has passed by now, yielding each."""
        while (deadline_ns := self.deadline_ns) is not None and deadline_ns <= now_ns:
            self.silent_slots += 1
            yield self._settle()

    def _settle(self) -> int:
        self.slot += 1
        return self.slot - 1
