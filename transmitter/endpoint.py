"""The sensor node without time and transport: messages and times in, messages and arrivals out.

A loop (`transmitter.loops`) asks when the next tick is due, gives it what came, and carries what it
returns. All times are flight times.
"""

from __future__ import annotations

from collections.abc import Iterable

from channel.line.line import Delivery, Inlet
from channel.line.meters import LatenessMeter
from channel.line.uplink import Uplink
from channel.protocol.endings import End
from channel.protocol.frames import Frame
from transmitter.node import TransmitterNode
from transmitter.session.rate_watch import RateWatch
from transmitter.session.session import Phase


class TransmitterEndpoint:
    """A node with its way in and its way out."""

    def __init__(self, node: TransmitterNode, uplink: Uplink) -> None:
        self.node = node
        self.uplink = uplink
        self.inlet = Inlet(uplink.wire, node.on_malformed)
        self.lateness = LatenessMeter()
        """of the ticks; on the virtual clock none is late"""
        self.ticks_missed = 0
        self.rate = RateWatch(node.session.terms)
        """whether the symbol rate is kept; a real loop looks at it"""
        self.tick = 0
        """the next one, or the one in hand"""
        self._end_tick = 0
        self._tick_ns = node.session.terms.tick_ns
        self._lateness_ns = 0

    @property
    def greeting(self) -> bool:
        """Return whether neither a session nor a refusal has come."""
        session = self.node.session
        return session.phase is Phase.GREETING and session.refusal is None

    def hello(self, now_ns: int) -> list[Delivery]:
        """Ask for a session; to be repeated while `greeting`."""
        return self._offer([self.node.session.hello()], now_ns)

    def begin(self, ticks: int) -> None:
        """Plan the given number of ticks.

        The first one is that of the session's first sample, which is not 0 when the receiver has been
        flying before.
        """
        self.tick = self.node.session.epoch_tick
        self._end_tick = self.tick + ticks

    @property
    def next_due_ns(self) -> int | None:
        return self.tick * self._tick_ns if self.tick < self._end_tick else None

    def begin_tick(self, now_ns: int) -> list[Delivery] | None:
        """Read the rig at the tick that is due; return what leaves, or None at the end of the flight.

        Ticks that have passed by `now_ns` are gone.
        """
        self._lateness_ns = now_ns - self.tick * self._tick_ns
        if self._lateness_ns:
            missed = min(self._lateness_ns // self._tick_ns, self._end_tick - self.tick)
            self.ticks_missed += missed
            self.tick += missed
            if self.tick == self._end_tick:
                return None
            self.lateness.add(self._lateness_ns)
        frames = None if self.node.over else self.node.measure(self.tick)
        return None if frames is None else self._offer(frames, now_ns)

    def end_tick(self) -> None:
        """Put the tick's voltages on the motors."""
        self.node.actuate(self.tick, self._lateness_ns)
        self.tick += 1

    def take(self, data: bytes, now_ns: int) -> list[Delivery]:
        """Take a message that arrived; return what answers it."""
        frame = self.inlet.take(data)
        return [] if frame is None else self._offer(self.node.deliver(frame), now_ns)

    def farewell(self, end: End) -> list[bytes]:
        """End the session; return the messages that tell the receiver.

        They are spared the line's delay and what goes wrong on it: this process is about to end.
        """
        return [self.uplink.counted(frame)[0] for frame in self.node.session.bye(end)]

    def _offer(self, frames: Iterable[Frame], now_ns: int) -> list[Delivery]:
        return [one for frame in frames for one in self.uplink.offer(frame, now_ns)]
