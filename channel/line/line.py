"""One direction of a line: when, and whether, a message arrives.

On the virtual clock the transmitter's process asks the line of each direction; on a real clock each
sender asks its own and holds the message back until it is due (`Outbox`). A line carries bytes: what a
message is, its wire can tell. `Inlet` is the other end of a line: bytes counted, frames decoded.

`Uplink` is the transmitter's way onto it, and what R baud means there, enforced and measured. Symbols
leave on a fixed grid of slots, one per slot and none in advance or afterwards: a request for more gets
an erasure, not a burst. Both loops of the transmitter send through it, so that no frame avoids the baud
rate. `Downlink` is the receiver's way.
"""

from __future__ import annotations

import heapq
from collections import Counter
from collections.abc import Callable, Iterable
from math import log2
from typing import NamedTuple, Protocol

from channel.codec.codec import Alphabet, Codec
from channel.errors import FrameError
from channel.protocol.frames import Commands, Frame, ShortCommands, ShortSymbol, Symbol
from channel.protocol.recording import SENT_CHANNEL, NullRecorder, Recorder
from channel.protocol.terms import Terms
from channel.protocol.wire import DATAGRAM, Wire


class Delivery(NamedTuple):
    """One arrival. A message that is lost has an arrival too, without data: time passed."""

    arrival_ns: int
    data: bytes | None


class Line(Protocol):
    """One direction of a line."""

    @property
    def longest_delay_ns(self) -> int:
        """Return how long a message may be under way."""

    @property
    def counts(self) -> Counter[str]:
        """Return the number of messages that it impaired on purpose, by kind."""

    def carry(self, data: bytes, now_ns: int) -> list[Delivery]:
        """Return the arrivals of a message put on the line at flight time `now_ns`."""


class CleanLine:
    """Every message arrives as it is, after the same delay."""

    def __init__(self, delay_ns: int = 0) -> None:
        self.longest_delay_ns = delay_ns
        self.counts: Counter[str] = Counter()

    def carry(self, data: bytes, now_ns: int) -> list[Delivery]:
        return [Delivery(now_ns + self.longest_delay_ns, data)]


class Outbox:
    """Messages held back until the line would have delivered them: for senders on a real clock.

    What is due at the same time leaves in the order in which it was put here.
    """

    def __init__(self) -> None:
        self._waiting: list[tuple[int, int, bytes]] = []
        self._order = 0

    def __len__(self) -> int:
        return len(self._waiting)

    @property
    def next_due_ns(self) -> int | None:
        return self._waiting[0][0] if self._waiting else None

    def put(self, deliveries: Iterable[Delivery]) -> None:
        """Hold the deliveries of a message; a lost one has none."""
        for arrival_ns, data in deliveries:
            if data is not None:
                self._order += 1
                heapq.heappush(self._waiting, (arrival_ns, self._order, data))

    def take(self, now_ns: int) -> list[bytes]:
        due: list[bytes] = []
        while self._waiting and self._waiting[0][0] <= now_ns:
            due.append(heapq.heappop(self._waiting)[2])
        return due


def no_compact_commands(frame: ShortCommands) -> None:
    """Raise FrameError: where none are expected they are damaged frames of other kinds."""
    raise FrameError("checksum")


class Inlet:
    """Turns messages into frames. `on_malformed` is called with the reason when one is dropped.

    `require_whole` raises FrameError for compact commands that are damaged, as only a session can tell.
    """

    def __init__(
        self,
        wire: Wire = DATAGRAM,
        on_malformed: Callable[[str], None] | None = None,
        require_whole: Callable[[ShortCommands], None] = no_compact_commands,
    ) -> None:
        self.wire = wire
        self.wire_bytes = 0
        self.control_bytes = 0
        """of `wire_bytes`, those of frames that carried neither a symbol nor commands"""
        self.command_bytes = 0
        """of command frames, without a line's framing"""
        self.malformed = 0
        self._on_malformed = on_malformed
        self._require_whole = require_whole

    def take(self, data: bytes) -> Frame | None:
        size = self.wire.size(data)
        self.wire_bytes += size
        try:
            frame = self.wire.decode(data)
            if isinstance(frame, ShortCommands):
                self._require_whole(frame)
        except FrameError as error:
            self.malformed += 1
            if self._on_malformed is not None:
                self._on_malformed(str(error))
            return None
        if isinstance(frame, (Commands, ShortCommands)):
            self.command_bytes += len(data)
        elif not isinstance(frame, (Symbol, ShortSymbol)):
            self.control_bytes += size
        return frame


class Downlink:
    """Everything that goes down. `line` is that of a real clock; its flight time begins with the first
    message.

    On the virtual clock the transmitter's process holds both lines, and only `encoded` is used.
    """

    def __init__(self, wire: Wire = DATAGRAM, line: Line | None = None) -> None:
        self.wire = wire
        self.line: Line = line or CleanLine()
        self.wire_bytes = 0
        self.command_bytes = 0
        """of command frames, without a line's framing"""
        self._outbox = Outbox()
        self._start_ns: int | None = None

    @property
    def next_due_ns(self) -> int | None:
        """Return when the next message leaves, None when none waits."""
        return self._outbox.next_due_ns

    def encoded(self, frames: Iterable[Frame]) -> list[bytes]:
        """Count frames; return their messages."""
        messages = []
        for frame in frames:
            message = self.wire.encode(frame)
            self.wire_bytes += self.wire.size(message)
            if isinstance(frame, (Commands, ShortCommands)):
                self.command_bytes += len(message)
            messages.append(message)
        return messages

    def offer(self, frames: Iterable[Frame], now_ns: int) -> list[bytes]:
        """Put frames on the line; return the messages that it has delivered by now."""
        for message in self.encoded(frames):
            if self._start_ns is None:
                self._start_ns = now_ns
            start_ns = self._start_ns
            self._outbox.put(
                Delivery(arrival_ns + start_ns, data)
                for arrival_ns, data in self.line.carry(message, now_ns - start_ns)
            )
        return self._outbox.take(now_ns)


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
    """Counts the transmitter's messages on the line."""

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
