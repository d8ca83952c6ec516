"""A way out onto a line: the shaper's grid, the line's delays and the meter, in one place.

Both drivers of an end send through it, so that nobody can go around the baud rate.
"""

from __future__ import annotations

from channel.frames import Frame, Symbol
from channel.line import Delivery, Line
from channel.shaper import SlotShaper, UplinkMeter
from channel.wire import DATAGRAM, Wire


class Uplink:
    """The transmitter's way out."""

    def __init__(
        self, shaper: SlotShaper, line: Line, meter: UplinkMeter, wire: Wire = DATAGRAM
    ) -> None:
        self.shaper = shaper
        self.line = line
        self.meter = meter
        self.wire = wire

    def offer(self, frame: Frame, now_ns: int) -> list[Delivery]:
        """Return the arrivals of a frame offered at flight time `now_ns`; none if it is refused."""
        is_symbol = isinstance(frame, Symbol)
        if isinstance(frame, Symbol):
            now_ns = self.shaper.leaves_ns(frame.slot, now_ns)
            if not self.shaper.admit(frame.slot, now_ns):
                return []
        data = self.wire.encode(frame)
        self.meter.count(frame, self.wire.size(data))
        return self.line.carry(data, is_symbol, now_ns)
