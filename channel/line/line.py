"""One direction of a line: when, and whether, a message arrives.

On the virtual clock the transmitter's process asks the line of each direction; on a real clock each
sender asks its own and holds the message back until it is due (`Outbox`). A line carries bytes: what a
message is, its wire can tell. `Inlet` is the other end of a line: bytes counted, frames decoded.

`Uplink` is the transmitter's way onto it, `Downlink` the receiver's. All loops send through them, so
that no symbol avoids the baud rate (`channel.line.slots`).
"""

from __future__ import annotations

import heapq
from collections import Counter
from collections.abc import Callable, Iterable
from math import log2
from typing import NamedTuple, Protocol

from channel.codec.codec import Alphabet, Codec
from channel.codec.downlink.layout import DOWN_ALPHABET
from channel.errors import FrameError
from channel.line.slots import Departure, Outlet, SymbolMeter
from channel.protocol.frames import DownSymbol, Frame, ShortCommands, Symbol
from channel.protocol.recording import DOWN_SENT_CHANNEL, SENT_CHANNEL, Recorder
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
    `bits_per_symbol`: of this direction.
    """

    def __init__(
        self,
        wire: Wire = DATAGRAM,
        on_malformed: Callable[[str], None] | None = None,
        require_whole: Callable[[ShortCommands], None] = no_compact_commands,
        bits_per_symbol: float = 1.0,
    ) -> None:
        self.wire = wire
        self.meter = SymbolMeter(bits_per_symbol)
        """malformed messages count among its `wire_bytes` only"""
        self.malformed = 0
        self._on_malformed = on_malformed
        self._require_whole = require_whole

    def take(self, data: bytes) -> Frame | None:
        size = self.wire.size(data)
        try:
            frame = self.wire.decode(data)
            if isinstance(frame, ShortCommands):
                self._require_whole(frame)
        except FrameError as error:
            self.malformed += 1
            self.meter.wire_bytes += size
            if self._on_malformed is not None:
                self._on_malformed(str(error))
            return None
        self.meter.count(frame, len(data), size)
        return frame


def bits_per_symbol(alphabet: Alphabet) -> float:
    """Return the bits that one symbol of an alphabet carries at most."""
    return log2(len(alphabet.symbols))


class Uplink(Outlet):
    """Everything that goes up: symbols in their slots, and control frames between them."""

    def __init__(
        self,
        terms: Terms,
        alphabet: Alphabet,
        line: Line | None = None,
        wire: Wire = DATAGRAM,
        recorder: Recorder | None = None,
    ) -> None:
        super().__init__(wire, terms.up_grid, bits_per_symbol(alphabet), SENT_CHANNEL, recorder)
        self.line: Line = line or CleanLine()
        self._symbol_delay_ns = terms.symbol_delay_ns

    def offer(self, frame: Frame, now_ns: int) -> list[Delivery]:
        """Return the arrivals of a frame offered at flight time `now_ns`; none if it is refused."""
        departure = self.departure(frame, now_ns)
        if departure is None:
            return []
        arrivals = self.line.carry(departure.data, departure.leaves_ns)
        delay_ns = self._symbol_delay_ns
        if delay_ns and isinstance(frame, Symbol):
            return [Delivery(arrival_ns + delay_ns, left) for arrival_ns, left in arrivals]
        return arrivals


class Downlink(Outlet):
    """Everything that goes down. `line` is that of a real clock; its flight time begins with the first
    message.

    With `terms` of the narrow downlink its symbols leave in their slots. On the virtual clock the
    transmitter's process holds both lines, and `offer` is not used.
    """

    def __init__(
        self,
        wire: Wire = DATAGRAM,
        line: Line | None = None,
        terms: Terms | None = None,
        recorder: Recorder | None = None,
    ) -> None:
        grid = terms.down_grid if terms is not None and terms.is_narrow else None
        super().__init__(wire, grid, bits_per_symbol(DOWN_ALPHABET), DOWN_SENT_CHANNEL, recorder)
        self.line: Line = line or CleanLine()
        self._delivery_ns = 0 if grid is None else grid.delivery_ns
        self._outbox = Outbox()
        self._start_ns: int | None = None

    @property
    def next_due_ns(self) -> int | None:
        """Return when the next message leaves, None when none waits."""
        return self._outbox.next_due_ns

    def departures(self, frames: Iterable[Frame], now_ns: int) -> list[Departure]:
        """Return the messages of frames offered at flight time `now_ns`, and when the line has them."""
        ready = []
        for frame in frames:
            departure = self.departure(frame, now_ns)
            if departure is not None and isinstance(frame, DownSymbol):
                departure = Departure(departure.leaves_ns + self._delivery_ns, departure.data)
            if departure is not None:
                ready.append(departure)
        return ready

    def offer(
        self, frames: Iterable[Frame], now_ns: int, flight_time: Callable[[], int]
    ) -> list[bytes]:
        """Put frames on the line; return the messages that it has delivered by now.

        `flight_time` returns the flight time now, by which symbols have slots.
        """
        if self.shaper is None and type(self.line) is CleanLine and not self.line.longest_delay_ns:
            # The usual line holds nothing back, and an answer that does not wait in a heap is sooner.
            return [self.encoded(frame) for frame in frames]
        flight_ns = flight_time()
        for leaves_ns, message in self.departures(frames, flight_ns):
            if self._start_ns is None:
                self._start_ns = now_ns
            start_ns = self._start_ns
            self._outbox.put(
                Delivery(arrival_ns + start_ns, data)
                for arrival_ns, data in self.line.carry(
                    message, now_ns - start_ns + leaves_ns - flight_ns
                )
            )
        return self._outbox.take(now_ns)


def bit_rate(codec: Codec, tick_s: float) -> float:
    """Return the bit/s that a codec's words have."""
    alphabet = codec.coder.alphabet
    bits = alphabet.symbols_per_word * bits_per_symbol(alphabet)
    return bits / (tick_s * codec.ticks_per_sample)
