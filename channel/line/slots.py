"""The way out of an end: the baud rate of a direction, enforced and measured.

Symbols leave on a fixed grid of slots, one per slot and none in advance or afterwards: a request for
more gets an erasure, not a burst. Control frames pass between the symbols and are counted apart.
"""

from __future__ import annotations

from typing import NamedTuple

from channel.protocol.frames import Commands, DownSymbol, Frame, ShortCommands, ShortSymbol, Symbol
from channel.protocol.recording import NullRecorder, RecordChannel, Recorder
from channel.protocol.terms import SlotGrid
from channel.protocol.wire import Wire


class SlotShaper:
    """Lets each slot's symbol leave once, when the slot begins or while it lasts."""

    def __init__(self, grid: SlotGrid) -> None:
        self._grid = grid
        self._next_slot = 0
        self.refused = 0
        """symbols that asked for a slot already used, over, or too far ahead"""

    def departure_ns(self, slot: int, now_ns: int) -> int | None:
        """Return when the symbol of this slot, offered now, leaves; None: it does not."""
        grid = self._grid
        begins = grid.slot_ns(slot)
        in_reach = begins - grid.ahead_ns <= now_ns < grid.slot_ns(slot + 1)
        if slot < self._next_slot or not in_reach:
            self.refused += 1
            return None
        self._next_slot = slot + 1
        return max(begins, now_ns)


class SymbolMeter:
    """Counts the frames of one direction by what they carry."""

    def __init__(self, bits_per_symbol: float = 1.0) -> None:
        self._bits_per_symbol = bits_per_symbol
        self.symbols = 0
        self.wire_bytes = 0
        self.control_bytes = 0
        """of `wire_bytes`, those of frames that carried neither a symbol nor commands"""
        self.command_bytes = 0
        """of command frames, without a line's framing"""

    def count(self, frame: Frame, message_bytes: int, size: int) -> None:
        """Count a frame that takes `size` bytes on the line, framing included."""
        self.wire_bytes += size
        if isinstance(frame, (Symbol, DownSymbol, ShortSymbol)):
            self.symbols += 1
        elif isinstance(frame, (Commands, ShortCommands)):
            self.command_bytes += message_bytes
        else:
            self.control_bytes += size

    @property
    def coder_bits(self) -> float:
        """Return the bits of symbols and command frames."""
        return self.symbols * self._bits_per_symbol + 8 * self.command_bytes


class Departure(NamedTuple):
    """A message and the flight time at which it leaves."""

    leaves_ns: int
    data: bytes


class Outlet:
    """Everything that leaves an end passes here. Without a grid its direction carries no symbols."""

    def __init__(
        self,
        wire: Wire,
        grid: SlotGrid | None,
        bits_per_symbol: float,
        channel: RecordChannel,
        recorder: Recorder | None,
    ) -> None:
        self.wire = wire
        self.shaper = None if grid is None else SlotShaper(grid)
        self.meter = SymbolMeter(bits_per_symbol)
        self._channel = channel
        self._recorder = recorder or NullRecorder()

    @property
    def refused(self) -> int:
        """Return how many symbols asked for a slot that they could not have."""
        return 0 if self.shaper is None else self.shaper.refused

    def encoded(self, frame: Frame) -> bytes:
        """Count a frame; return its message."""
        data = self.wire.encode(frame)
        self.meter.count(frame, len(data), self.wire.size(data))
        return data

    def departure(self, frame: Frame, now_ns: int) -> Departure | None:
        """Return the message of a frame offered at flight time `now_ns`; None: it misses its slot."""
        if self.shaper is None or not isinstance(frame, (Symbol, DownSymbol)):
            return Departure(now_ns, self.encoded(frame))
        slot, number = frame.slot, frame.number
        leaves_ns = self.shaper.departure_ns(slot, now_ns)
        if leaves_ns is None:
            self._recorder.write(self._channel, now_ns, (slot, number, None, 0))
            return None
        data = self.encoded(frame)
        row = (slot, number, leaves_ns, self.wire.size(data))
        self._recorder.write(self._channel, leaves_ns, row)
        return Departure(leaves_ns, data)
