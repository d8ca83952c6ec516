"""One direction of a line as the flight experiences it: when, and whether, a message arrives.

On the virtual clock the transmitter's process asks the line of each direction; on a real clock each
sender asks its own and holds the message back until it is due (`Outbox`). A line carries bytes: what a
message is, its wire can tell. `Inlet` is the other end of a line: bytes counted, frames decoded.
`Downlink` is the receiver's way onto it; the transmitter's is `channel/line/uplink.py`.
"""

from __future__ import annotations

import heapq
from collections import Counter
from collections.abc import Callable, Iterable
from typing import NamedTuple, Protocol

from channel.errors import FrameError
from channel.protocol.frames import Commands, Frame, ShortSymbol, Symbol
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
        """Return how many messages it did what to, on purpose."""

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
        """Hold what a line makes of a message; a lost one leaves nothing."""
        for arrival_ns, data in deliveries:
            if data is not None:
                self._order += 1
                heapq.heappush(self._waiting, (arrival_ns, self._order, data))

    def take(self, now_ns: int) -> list[bytes]:
        due: list[bytes] = []
        while self._waiting and self._waiting[0][0] <= now_ns:
            due.append(heapq.heappop(self._waiting)[2])
        return due


class Inlet:
    """Turns messages into frames. `on_malformed` is called with the reason when one is dropped."""

    def __init__(
        self, wire: Wire = DATAGRAM, on_malformed: Callable[[str], None] | None = None
    ) -> None:
        self.wire = wire
        self.wire_bytes = 0
        self.control_bytes = 0
        """of `wire_bytes`, those of frames that carried neither a symbol nor commands"""
        self.malformed = 0
        self._on_malformed = on_malformed

    def take(self, data: bytes) -> Frame | None:
        size = self.wire.size(data)
        self.wire_bytes += size
        try:
            frame = self.wire.decode(data)
        except FrameError as error:
            self.malformed += 1
            if self._on_malformed is not None:
                self._on_malformed(str(error))
            return None
        if not isinstance(frame, (Commands, Symbol, ShortSymbol)):
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
        self._outbox = Outbox()
        self._start_ns: int | None = None

    @property
    def next_due_ns(self) -> int | None:
        """Return when the next message leaves, None when none waits."""
        return self._outbox.next_due_ns

    def encoded(self, frames: Iterable[Frame]) -> list[bytes]:
        """Count frames; return their messages."""
        messages = [self.wire.encode(frame) for frame in frames]
        for message in messages:
            self.wire_bytes += self.wire.size(message)
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
