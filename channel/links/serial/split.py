"""A link whose two directions are two lines: a slow serial line up, something faster down."""

from __future__ import annotations

from dataclasses import fields
from operator import add

from channel.links.base import Link, LinkCounts, Role
from channel.protocol.frames import DownSymbol, Frame
from channel.protocol.wire import Wire, is_short

DOWNWARD_KINDS = (2, 3, 5, 8, 9, 10)
"""Frame kinds that only the receiver sends: welcome, refuse, commands, unknown, claim, down symbol."""


class SplitWire:
    """Looks like the upward line's wire; sizes of downward frames are the downward line's."""

    def __init__(self, up: Wire, down: Wire) -> None:
        self.decode = up.decode
        self._up, self._down = up, down

    def encode(self, frame: Frame) -> bytes:
        """Return the message for a frame, a down symbol's as the downward line has it."""
        return (self._down if isinstance(frame, DownSymbol) else self._up).encode(frame)

    def is_symbol(self, data: bytes) -> bool:
        return self._up.is_symbol(data) or self._down.is_symbol(data)

    def renumbered(self, data: bytes, shift: int, kinds: int) -> bytes:
        wire = self._up if self._up.is_symbol(data) else self._down
        return wire.renumbered(data, shift, kinds)

    def size(self, data: bytes) -> int:
        downward = is_short(data) or (len(data) > 1 and data[1] in DOWNWARD_KINDS)
        return (self._down if downward else self._up).size(data)


class SplitLink(Link):
    """Sends on one link and hears on the other, as the role asks; owns and closes both."""

    def __init__(self, role: Role, up: Link, down: Link) -> None:
        self.name = f"{up.name} up, {down.name} down"
        self.wire: Wire = SplitWire(up.wire, down.wire)
        self.start_ns = up.start_ns
        self._out, self._in = (up, down) if role == "transmitter" else (down, up)

    @property
    def counts(self) -> LinkCounts:
        """Return the sums: messages go out on the one and come in on the other only."""
        both = self._out.counts, self._in.counts
        names = [one.name for one in fields(LinkCounts)]
        first, second = ([getattr(counts, name) for name in names] for counts in both)
        return LinkCounts(*map(add, first, second))

    def send(self, data: bytes) -> None:
        self._out.send(data)

    def receive(self, timeout_s: float) -> bytes | None:
        """Return the next message of the inward line, or None after `timeout_s` seconds."""
        return self._in.receive(timeout_s)

    def peer_present(self) -> bool:
        """Return whether the peer is known to be there on the inward line."""
        return self._in.peer_present()

    def trouble(self) -> str:
        return self._out.trouble() or self._in.trouble()

    def close(self) -> None:
        self._out.close()
        self._in.close()
