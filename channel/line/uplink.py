"""A way out onto a line: the shaper's grid, the line's delays and the meter, in one place.

Both drivers of an end send through it, so that nobody can go around the baud rate.
"""

from __future__ import annotations

from channel.line.line import Delivery, Line
from channel.line.shaper import SlotShaper, UplinkMeter
from channel.protocol.audit_trail import SENT_CHANNEL
from channel.protocol.frames import Frame, Symbol
from channel.protocol.recording import NullRecorder, Recorder
from channel.protocol.wire import DATAGRAM, Wire


class Uplink:
    """The transmitter's way out."""

    def __init__(
        self,
        shaper: SlotShaper,
        line: Line,
        meter: UplinkMeter,
        wire: Wire = DATAGRAM,
        recorder: Recorder | None = None,
    ) -> None:
        self.shaper = shaper
        self.line = line
        self.meter = meter
        self.wire = wire
        self._recorder = recorder or NullRecorder()

    def offer(self, frame: Frame, now_ns: int) -> list[Delivery]:
        """Return the arrivals of a frame offered at flight time `now_ns`; none if it is refused."""
        leaves_ns: int | None = now_ns
        if isinstance(frame, Symbol):
            leaves_ns = self.shaper.departure_ns(frame.slot, now_ns)
            if leaves_ns is None:
                self._recorder.write(SENT_CHANNEL, now_ns, (frame.slot, frame.number, None, 0))
        if leaves_ns is None:
            return []
        data, size = self.counted(frame)
        if isinstance(frame, Symbol):
            self._recorder.write(SENT_CHANNEL, leaves_ns, (frame.slot, frame.number, leaves_ns, size))
        return self.line.carry(data, isinstance(frame, Symbol), leaves_ns)

    def counted(self, frame: Frame) -> tuple[bytes, int]:
        """Count a frame that bypasses the line; return its bytes and its size on the wire."""
        data = self.wire.encode(frame)
        size = self.wire.size(data)
        self.meter.count(frame, size)
        return data, size
