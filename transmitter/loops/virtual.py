"""The sensor node on the virtual clock: as fast as the messages go, and the same every time.

Every message has an arrival in virtual time; they wait in one queue, uplink and downlink together,
and are taken out in order of time. At its arrival an uplink message is given to the peer as one step,
and the peer's reply puts its frames into the queue. A deadline of the peer is a step without a
message. So virtual time never passes an arrival that could still change it.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable, Sequence
from itertools import count
from typing import NamedTuple

from channel.line.inlet import Inlet
from channel.line.line import Delivery, Line
from channel.line.uplink import Uplink
from channel.line.virtual import Peer, Reply
from channel.protocol.endings import End
from channel.protocol.frames import Frame
from transmitter.node import TransmitterNode
from transmitter.session.session import Phase

GREETINGS_MAX = 1000
"""Requests for a session before the line is given up."""


class _Arrival(NamedTuple):
    time_ns: int
    order: int
    upward: bool
    data: bytes | None


class VirtualFlight:
    """Flies a node against a peer; see the module's text."""

    def __init__(self, node: TransmitterNode, uplink: Uplink, downlink: Line, peer: Peer) -> None:
        self._node = node
        self._uplink = uplink
        self._downlink = downlink
        self._peer = peer
        self._arrivals: list[_Arrival] = []
        self._order = count()
        self._deadline_ns: int | None = None
        self.inlet = Inlet(uplink.wire, node.on_malformed)

    def greet(self) -> None:
        """Carry the handshake out; the session then flies or holds a refusal, or nobody answered.

        It takes place before the flight's time begins, however long the line takes.
        """
        session = self._node.session
        for _ in range(GREETINGS_MAX):
            self._offer([session.hello()], 0)
            while self._arrivals:
                self._pass_to(self._arrivals[0].time_ns)
            if session.phase is not Phase.GREETING or session.refusal is not None:
                return

    def run(self, ticks: int, should_stop: Callable[[], bool] = lambda: False) -> int:
        """Fly so many ticks, or until the end of the rig or the safe voltage; return the tick reached.

        The first tick is that of the session's first sample, which is not 0 when the receiver has
        been flying before.
        """
        node = self._node
        tick_ns = node.session.terms.tick_ns
        first = node.session.epoch_tick
        for tick in range(first, first + ticks):
            now_ns = tick * tick_ns
            self._pass_to(now_ns)
            if node.over:
                return tick
            if should_stop():
                node.stop()
            frames = node.measure(tick)
            if frames is None:
                return tick
            if frames:
                self._offer(frames, now_ns)
                self._pass_to(now_ns)
            node.actuate(tick)
        return first + ticks

    def finish(self, tick: int, farewell: Callable[[], End]) -> None:
        """Let the last echoes come in, then end the session on both sides.

        `farewell` is asked for what the receiver is told once they are in.
        """
        terms = self._node.session.terms
        now_ns = tick * terms.tick_ns
        # What is still on the line arrives within one delivery and one deadline either way.
        linger_ns = terms.uplink_delivery_ns + terms.symbol_delay_ns + terms.downlink_budget_ns
        linger_ns += self._uplink.line.longest_delay_ns + self._downlink.longest_delay_ns
        self._pass_to(now_ns + linger_ns, deadlines=False)
        self._node.rest()
        # The farewell is spared what goes wrong on the line: the receiver's process must hear it.
        for frame in self._node.session.bye(farewell()):
            self._step(now_ns + linger_ns, self._uplink.counted(frame)[0])

    def _offer(self, frames: Sequence[Frame], now_ns: int) -> None:
        for frame in frames:
            for delivery in self._uplink.offer(frame, now_ns):
                self._push(delivery, upward=True)

    def _push(self, delivery: Delivery, upward: bool) -> None:
        arrival = _Arrival(delivery.arrival_ns, next(self._order), upward, delivery.data)
        heapq.heappush(self._arrivals, arrival)

    def _pass_to(self, now_ns: int, deadlines: bool = True) -> None:
        """Let virtual time pass to `now_ns`, this moment included."""
        while True:
            arrival = self._arrivals[0] if self._arrivals else None
            deadline = self._deadline_ns if deadlines else None
            if deadline is not None and (arrival is None or deadline < arrival.time_ns):
                if deadline > now_ns:
                    return
                self._step(deadline, None)
                continue
            if arrival is None or arrival.time_ns > now_ns:
                return
            heapq.heappop(self._arrivals)
            if arrival.upward:
                self._step(arrival.time_ns, arrival.data)
            elif arrival.data is not None:
                self._take(arrival.data, arrival.time_ns)

    def _step(self, time_ns: int, data: bytes | None) -> None:
        reply: Reply = self._peer.step(time_ns, data)
        # A peer in another process had it done while it was waited for.
        self._node.rest()
        self._deadline_ns = reply.deadline_ns
        for frame in reply.frames:
            for delivery in self._downlink.carry(frame, False, time_ns):
                self._push(delivery, upward=False)

    def _take(self, data: bytes, now_ns: int) -> None:
        frame = self.inlet.take(data)
        if frame is not None:
            self._offer(self._node.deliver(frame), now_ns)
