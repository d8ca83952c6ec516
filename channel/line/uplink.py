"""The transmitter's way out onto a line: slot grid, delivery time, meter and line, in one place.

Both loops of the transmitter send through it, so that nobody can go around the baud rate.
"""

from __future__ import annotations

from channel.codec.words import Alphabet
from channel.line.line import CleanLine, Delivery, Line
from channel.line.shaper import SlotShaper, UplinkMeter
from channel.protocol.audit_trail import SENT_CHANNEL
from channel.protocol.frames import Frame, Symbol
from channel.protocol.recording import NullRecorder, Recorder
from channel.protocol.terms import Terms
from channel.protocol.wire import DATAGRAM, Wire


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
