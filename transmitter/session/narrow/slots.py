"""The down symbols of the samples that were not heard yet, and when a missing one is given up.

A sample is heard when all its symbols have come, or from the first tick at or after its deadline on;
what is missing then is erased. On a line that is slower than agreed every symbol would come too late:
after `LATE_IN_A_ROW` late ones, with none in time between them, deadlines move by what they needed.
"""

from __future__ import annotations

from collections import deque
from enum import Enum, auto

from channel.protocol.terms import Terms

LATE_IN_A_ROW = 3
REMEMBERED = 64
"""Samples after which a delay that was needed once is forgotten."""

Symbols = tuple[int | None, ...]


class Came(Enum):
    """What a symbol that comes is."""

    NEW = auto()
    AGAIN = auto()
    """its slot had a symbol, or is long past: a copy"""
    LATE = auto()
    """its sample was heard without it"""


class DownSlots:
    """Collects symbols; see the module's text. Times are ticks.

    `line_delay_ns`: by how much the two lines may delay messages beyond what is agreed.
    """

    def __init__(self, terms: Terms, line_delay_ns: int = 0) -> None:
        self.sample = 0
        """the one that is heard next"""
        self._terms = terms
        self._line_delay_ns = line_delay_ns
        self._kept: dict[int, list[int | None]] = {}
        self._needed: deque[int] = deque(maxlen=REMEMBERED)
        """ticks beyond the agreed deadline"""
        self._late: list[int] = []
        self._given_up: deque[int] = deque(maxlen=terms.history_samples * terms.down_symbols)
        """slots of samples that were heard without their symbol, and to which none has come since"""

    def restart(self, sample: int) -> None:
        """Forget what came; this sample is heard next."""
        self.sample = sample
        self._kept.clear()
        self._late.clear()
        self._given_up.clear()

    def put(self, slot: int, number: int, tick: int) -> Came:
        """Take a symbol that came at a tick."""
        sample, place = divmod(slot, self._terms.down_symbols)
        over = tick - self._agreed_tick(sample)
        if sample < self.sample:
            if slot not in self._given_up:
                # A copy says nothing of how late the line is.
                return Came.AGAIN
            self._given_up.remove(slot)
            self._late.append(max(0, over))
            if len(self._late) == LATE_IN_A_ROW:
                self._needed.append(min(max(self._late), self._longest))
                self._late.clear()
            return Came.LATE
        symbols = self._kept.setdefault(sample, [None] * self._terms.down_symbols)
        if symbols[place] is not None:
            return Came.AGAIN
        symbols[place] = number
        self._late.clear()
        if None not in symbols:
            self._needed.append(min(max(0, over), self._longest))
        return Came.NEW

    def take(self, tick: int) -> Symbols | None:
        """Return the symbols of the next sample, if it is heard by now; they are taken with that."""
        symbols = self._kept.get(self.sample)
        if symbols is None or None in symbols:
            if tick < self._agreed_tick(self.sample) + max(self._needed, default=0):
                return None
            symbols = symbols or [None] * self._terms.down_symbols
            first = self.sample * len(symbols)
            self._given_up += [slot for slot, one in enumerate(symbols, first) if one is None]
        self._kept.pop(self.sample, None)
        self.sample += 1
        return tuple(symbols)

    @property
    def _longest(self) -> int:
        return self._terms.history_samples * self._terms.ticks_per_sample

    def _agreed_tick(self, sample: int) -> int:
        terms = self._terms
        heard_ns = sample * terms.sample_ns + terms.heard_ns + self._line_delay_ns
        return -(-heard_ns // terms.tick_ns)
