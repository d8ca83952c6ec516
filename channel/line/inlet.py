"""The way in from a line: bytes counted, frames decoded, what is no frame counted and told.

Every driver of either end takes its messages through it, so that they all count alike.
"""

from __future__ import annotations

from collections.abc import Callable

from channel.errors import FrameError
from channel.protocol.frames import Commands, Frame, ShortSymbol, Symbol
from channel.protocol.wire import DATAGRAM, Wire


class Inlet:
    """Turns messages into frames. `on_malformed` is told why a message was dropped."""

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
        """Return the frame in a message; None when there is none."""
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
