"""The transmitter's way out onto a line, and what R baud means there, enforced and measured.

Symbols leave on a fixed grid of slots, one per slot and none in advance or afterwards: a request
for more gets an erasure, not a burst. Both loops of the transmitter send through it, so that nobody can
go around the baud rate.
"""

from __future__ import annotations

from math import log2

from channel.codec.codec import Codec
from channel.codec.words import Alphabet
from channel.line.line import CleanLine, Delivery, Line
from channel.protocol.frames import Frame, Symbol
from channel.protocol.recording import SENT_CHANNEL, NullRecorder, Recorder
from channel.protocol.terms import Terms
from channel.protocol.wire import DATAGRAM, Wire


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


def bits_per_symbol(alphabet: Alphabet) -> float:
    """Return the bits that one symbol of an alphabet carries at most."""
    return log2(len(alphabet.symbols))


class UplinkMeter:
    """Counts what the transmitter put on the line."""

    def __init__(self, alphabet: Alphabet) -> None:
        self._bits_per_symbol = bits_per_symbol(alphabet)
        self.symbols = 0
        self.wire_bytes = 0
        self.control_bytes = 0
        """of `wire_bytes`, those that carried no symbol"""

    def count(self, frame: Frame, size: int) -> None:
        self.wire_bytes += size
        if isinstance(frame, Symbol):
            self.symbols += 1
        else:
            self.control_bytes += size

    @property
    def coder_bits(self) -> float:
        return self.symbols * self._bits_per_symbol


class Uplink:
    """Everything that goes up: symbols in their slots, and control frames between them."""

    def __init__(
        self,
        terms: Terms,
        alphabet: Alphabet,
        line: Line | None = None,
        wire: Wire = DATAGRAM,
        recorder: Recorder | None = None,
    ) -> None:
        self.shaper = SlotShaper(terms)
        self.meter = UplinkMeter(alphabet)
        self.line: Line = line or CleanLine()
        self.wire = wire
        self._symbol_delay_ns = terms.symbol_delay_ns
        self._recorder = recorder or NullRecorder()

    def offer(self, frame: Frame, now_ns: int) -> list[Delivery]:
        """Return the arrivals of a frame offered at flight time `now_ns`; none if it is refused."""
        if not isinstance(frame, Symbol):
            return self.line.carry(self.counted(frame)[0], now_ns)
        leaves_ns = self.shaper.departure_ns(frame.slot, now_ns)
        if leaves_ns is None:
            self._recorder.write(SENT_CHANNEL, now_ns, (frame.slot, frame.number, None, 0))
            return []
        data, size = self.counted(frame)
        self._recorder.write(SENT_CHANNEL, leaves_ns, (frame.slot, frame.number, leaves_ns, size))
        arrivals = self.line.carry(data, leaves_ns)
        delay_ns = self._symbol_delay_ns
        if delay_ns:
            return [Delivery(arrival_ns + delay_ns, left) for arrival_ns, left in arrivals]
        return arrivals

    def counted(self, frame: Frame) -> tuple[bytes, int]:
        """Count a frame that bypasses the line; return its bytes and its size on the wire."""
        data = self.wire.encode(frame)
        size = self.wire.size(data)
        self.meter.count(frame, size)
        return data, size


def bit_rate(codec: Codec, tick_s: float) -> float:
    """Return the bit/s that a codec's words have."""
    alphabet = codec.coder.alphabet
    bits = alphabet.symbols_per_word * bits_per_symbol(alphabet)
    return bits / (tick_s * codec.ticks_per_sample)
