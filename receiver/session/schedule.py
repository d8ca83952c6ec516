"""The next slot to decide, and when slots are due by this end's clock.

`SlotClock` settles a slot on its symbol, on a later one, or at its deadline; the schedule of studies
counts with it too. `Schedule` knows how far ahead of the clock a slot may be, and which symbols count.

The transmitter sends one symbol a slot, so each symbol that is taken says where the schedule lies. A
symbol long before its time is not the transmitter's, or the clock here was set; one after its deadline
comes too late, or the schedule has been wrong. Either is dropped, but `RIVALS` of them in a row that
fit each other as slots do, and none in between that fits the schedule, replace it.

An early symbol does not move the schedule: a single forged one costs the slots before it, at most
`EARLY_SAMPLES` and the deadline allowance, and later ones are as good as before.
"""

from __future__ import annotations

from collections.abc import Iterator
from enum import Enum, auto
from typing import NamedTuple

from channel.protocol.rivals import Rivals
from channel.protocol.terms import Terms
from receiver.session.commander import Standing

EARLY_SAMPLES = 4
"""Symbols may come this much before their time, beside the deadline allowance: the one before may have
been late, or the first of a heap."""

GAIN = 1.0 / 16.0
"""How much of its lateness, and of one slot at most, each symbol moves the schedule."""

DRIFT = 1e-3
"""How much two clocks may drift apart, as a share of the time since the last symbol."""

RIVAL_SLOTS = 0.9
"""How far the distance of two symbols may be off the slots between them."""


class Timing(Enum):
    """How a symbol fits the schedule."""

    DUE = auto()
    EARLY = auto()
    NEW = auto()
    """the last of a row that replaces the schedule"""


class Schedule:
    """Knows the slot that is due; times are of this end's clock."""

    def __init__(self, terms: Terms) -> None:
        self._terms = terms
        self._grid = terms.up_grid
        self._slot_ns = self._grid.length_ns
        self._largest_ns = round(self._slot_ns)
        self._early_ns = EARLY_SAMPLES * terms.sample_ns + terms.deadline_allowance_ns
        self._zero_ns = 0
        """when slot 0 was, or would have been, due"""
        self._heard_ns: int | None = None
        """when the last symbol came; None: before the first epoch nothing is known"""
        self._is_guess = True
        """whether no symbol of the epoch has come, so that `_zero_ns` is the earliest that can be"""
        self._rivals = Rivals(self._slot_ns, RIVAL_SLOTS)

    def begin(self, slot: int, now_ns: int) -> None:
        """Begin an epoch at a slot that is not due before now."""
        self._zero_ns = now_ns - self._terms.slot_ns(slot)
        self._heard_ns = now_ns
        self._is_guess = True
        self._rivals.clear()

    def flight_ns(self, now_ns: int) -> int:
        """Return the flight time as this end knows it: a way up later than at the transmitter."""
        return now_ns - self._zero_ns + self._grid.due_ns(0)

    def reaches(self, sample: int, now_ns: int) -> bool:
        """Return whether the transmitter's clock can say that this sample is the next."""
        slot = sample * self._terms.symbols_per_word
        return self._early(slot, now_ns) <= self._early_ns + self._terms.sample_ns

    def timing(self, slot: int, now_ns: int) -> Timing:
        """Return how a symbol that comes now fits."""
        if self._early(slot, now_ns) <= self._early_ns:
            return Timing.DUE
        return Timing.NEW if self.is_replaced_by(slot, now_ns) else Timing.EARLY

    def is_replaced_by(self, slot: int, now_ns: int) -> bool:
        """Note a symbol that does not fit; return whether it is the last of an accepted row."""
        return self._rivals.complete(slot, now_ns)

    def take(self, slot: int, now_ns: int, *, anew: bool = False) -> tuple[int, int]:
        """Take a symbol; return the (slot, time) that the next deadlines count from.

        `anew`: it replaces the schedule.
        """
        zero_ns = now_ns - self._terms.slot_ns(slot)
        if anew or self._is_guess:
            self._zero_ns = zero_ns
        off_ns = zero_ns - self._zero_ns
        early = -off_ns > self._terms.deadline_allowance_ns
        largest_ns = self._largest_ns
        self._zero_ns += round(GAIN * max(-largest_ns, min(largest_ns, off_ns)))
        self._heard_ns = now_ns
        self._is_guess = False
        self._rivals.clear()
        return slot, now_ns - off_ns if early else now_ns

    def _early(self, slot: int, now_ns: int) -> float:
        """Return by how much a slot lies ahead of the clock, ns, doubts about the clock taken off."""
        if self._heard_ns is None:
            return 0.0
        doubt_ns = DRIFT * abs(now_ns - self._heard_ns)
        return self._zero_ns + self._terms.slot_ns(slot) - now_ns - doubt_ns


class Proven(NamedTuple):
    """The flight as the last symbol left it: nothing that was only offered since is in it."""

    standing: Standing
    schedule: Schedule
    silent_slots: int
    incarnation: int | None
    """of the transmitter flown with; None: none yet"""


class SlotClock:
    """Counts the slots of an epoch. Settled slots are final: later messages do not change them."""

    def __init__(self, terms: Terms, slot: int = 0) -> None:
        self.slot = slot
        """the first one that is not settled"""
        self.silent_slots = 0
        """settled by their deadlines since the last symbol"""
        self._terms = terms
        self._gap_slots_max = terms.history_samples * terms.symbols_per_word
        self._zero_deadline_ns: int | None = None
        """deadline of slot 0, if it had one"""

    @property
    def deadline_ns(self) -> int | None:
        """Return when the next slot is taken for erased; None: not by the clock."""
        if self._zero_deadline_ns is None:
            return None
        return self._zero_deadline_ns + self._terms.slot_ns(self.slot)

    @property
    def is_silent(self) -> bool:
        """Return whether nothing has come for so long that no slot is due by the clock any more."""
        return self.silent_slots >= self._gap_slots_max

    def bridges(self, slot: int) -> bool:
        """Return whether a slot is so near that the slots between are a gap and not another flight."""
        return abs(slot - self.slot) <= self._gap_slots_max

    def anchor(self, at: tuple[int, int] | None) -> None:
        """Count deadlines from this (slot, time), or from nothing any more."""
        self._zero_deadline_ns = None
        if at is not None:
            slot, time_ns = at
            allowed_ns = time_ns + self._terms.deadline_allowance_ns
            self._zero_deadline_ns = allowed_ns - self._terms.slot_ns(slot)

    def take(self, slot: int) -> range:
        """Settle the slot of a symbol, and those before it, which are returned."""
        missed = range(self.slot, slot)
        self.silent_slots = 0
        self.slot = max(self.slot, slot) + 1
        return missed

    def expired(self, now_ns: int) -> Iterator[int]:
        """Settle the slots whose deadline has passed by now, yielding each."""
        while (deadline_ns := self.deadline_ns) is not None and deadline_ns <= now_ns:
            self.silent_slots += 1
            self.slot += 1
            yield self.slot - 1
