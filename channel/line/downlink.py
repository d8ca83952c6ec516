"""The receiver's way out onto a line: meter, line, and what waits until the line has delivered it."""

from __future__ import annotations

from collections.abc import Iterable

from channel.line.line import CleanLine, Delivery, Line, Outbox
from channel.protocol.frames import Frame
from channel.protocol.wire import DATAGRAM, Wire


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
