"""What R baud means, enforced and measured.

Symbols leave on a fixed grid of slots, one per slot and none in advance or afterwards: whoever asks
for more gets an erasure, not a burst. The two meters count what was paid for: coder bits on the way
out, symbols per second on the receiver's own clock on the way in.
"""

from __future__ import annotations

from math import log2

from channel.codec.words import Alphabet
from channel.protocol.frames import Frame, Symbol
from channel.protocol.terms import Terms


class SlotShaper:
    """Lets each slot's symbol leave once, when the slot begins or while it lasts."""

    def __init__(self, terms: Terms) -> None:
        self._terms = terms
        self._next_slot = 0
        self.refused = 0
        """symbols that asked for a slot already used, over, or more than a sample away"""

    def departure_ns(self, slot: int, now_ns: int) -> int | None:
        """Return when the symbol of this slot, offered now, leaves; None: it does not."""
        begins = self._terms.slot_ns(slot)
        ends = self._terms.slot_ns(slot + 1)
        if slot < self._next_slot or not begins - self._terms.sample_ns <= now_ns < ends:
            self.refused += 1
            return None
        self._next_slot = slot + 1
        return max(begins, now_ns)


class UplinkMeter:
    """Counts what the transmitter put on the line."""

    def __init__(self, alphabet: Alphabet) -> None:
        self._bits_per_symbol = log2(len(alphabet.symbols))
        self.symbols = 0
        self.wire_bytes = 0
        self.control_bytes = 0
        """of `wire_bytes`, those that carried no symbol"""

    def count(self, frame: Frame, size: int) -> None:
        """Count one frame of `size` bytes."""
        self.wire_bytes += size
        if isinstance(frame, Symbol):
            self.symbols += 1
        else:
            self.control_bytes += size

    @property
    def coder_bits(self) -> float:
        """Return the bits that the coder was paid for."""
        return self.symbols * self._bits_per_symbol


class BaudMeter:
    """Measures symbols per second on the receiver's clock, between the first symbol and the last."""

    def __init__(self) -> None:
        self.symbols = 0
        self._first_ns = 0
        self._last_ns = 0

    def on_symbol(self, now_ns: int) -> None:
        """Count one symbol that arrived in time."""
        if self.symbols == 0:
            self._first_ns = now_ns
        self._last_ns = now_ns
        self.symbols += 1

    @property
    def baud(self) -> float | None:
        """Return the measured rate; None before two symbols came at different times."""
        span_ns = self._last_ns - self._first_ns
        return (self.symbols - 1) * 1e9 / span_ns if span_ns > 0 else None
