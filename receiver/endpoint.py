"""The controller node without time and transport: bytes in, bytes out.

Both drivers of the receiver, and a flight within one process, go through it.
"""

from __future__ import annotations

from channel.line.inlet import Inlet
from channel.line.line import Line
from channel.line.virtual import Reply
from channel.protocol.endings import End
from channel.protocol.frames import Frame
from channel.protocol.wire import DATAGRAM, Wire
from receiver.session.session import ReceiverSession


class ReceiverEndpoint:
    """Decodes what arrives for a session and encodes what it answers."""

    def __init__(self, session: ReceiverSession, wire: Wire = DATAGRAM) -> None:
        self.session = session
        self.wire = wire
        self.wire_bytes_down = 0
        self.inlet = Inlet(wire, session.on_malformed)
        self.downlink = Line()
        """this end's own way out, on a real clock"""

    def on_bytes(self, data: bytes, now_ns: int) -> list[bytes]:
        """Take one message that arrived at `now_ns`; return the messages to send."""
        frame = self.inlet.take(data)
        if frame is None:
            return []
        return self._encode(self.session.on_frame(frame, now_ns))

    def on_time(self, now_ns: int) -> list[bytes]:
        """Let the deadlines up to `now_ns` pass; return the messages to send."""
        return self._encode(self.session.on_deadline(now_ns))

    def bye(self, end: End) -> list[bytes]:
        """End the session; return the messages that tell the peer."""
        return self._encode(self.session.bye(end))

    def step(self, time_ns: int, data: bytes | None) -> Reply:
        """Do one step of the virtual clock within this process (`channel.line.virtual.Peer`).

        A symbol that arrives exactly at its deadline is in time, so it is taken first.
        """
        messages = self.on_bytes(data, time_ns) if data is not None else []
        messages += self.on_time(time_ns)
        return Reply(0, self.session.next_deadline(), tuple(messages))

    def _encode(self, frames: list[Frame]) -> list[bytes]:
        messages = [self.wire.encode(frame) for frame in frames]
        for message in messages:
            self.wire_bytes_down += self.wire.size(message)
        return messages
