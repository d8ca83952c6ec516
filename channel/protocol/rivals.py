"""Symbols that do not fit a schedule, but each other: enough of them in a row replace it."""

from __future__ import annotations

RIVALS = 3


class Rivals:
    """Looks for a row of `RIVALS` symbols that lie as far apart as their slots.

    `tolerance`: by how many slots their distance may be off. Below one, so that symbols of different
    slots that come together are never a row.
    """

    def __init__(self, slot_ns: float, tolerance: float) -> None:
        self._slot_ns = slot_ns
        self._tolerance = tolerance
        self._slot = self._time_ns = self._in_a_row = 0

    def clear(self) -> None:
        """Forget the row: a symbol has fitted the schedule."""
        self._in_a_row = 0

    def complete(self, slot: int, time_ns: int) -> bool:
        """Take a symbol that does not fit the schedule; return whether it is the last of a row."""
        slots = (time_ns - self._time_ns) / self._slot_ns
        fits = slot > self._slot and abs(slot - self._slot - slots) <= self._tolerance
        self._in_a_row = self._in_a_row + 1 if self._in_a_row and fits else 1
        self._slot, self._time_ns = slot, time_ns
        return self._in_a_row >= RIVALS
