"""The sensor node on the virtual clock: as fast as the messages, and reproducible.

Every message has an arrival in virtual time; they wait in one queue, uplink and downlink together,
and are taken out in order of time. At its arrival an uplink message is given to the peer as one step,
and the peer's reply puts its frames into the queue. A deadline of the peer is a step without a
message. So virtual time never passes an arrival that could still change it.
"""

from __future__ import annotations

import heapq
import time
from collections.abc import Callable
from itertools import count
from typing import NamedTuple

from channel.errors import FrameError, LinkLost
from channel.line.line import Delivery, Line
from channel.line.virtual import Peer, Reply, Step, decode_reply, encode_step, is_envelope
from channel.links.base import Link
from transmitter.endpoint import TransmitterEndpoint
from transmitter.loops.flight import Flight

GREETINGS_MAX = 1000
"""Requests for a session before the line is given up."""


class _Arrival(NamedTuple):
    time_ns: int
    order: int
    upward: bool
    data: bytes | None


class VirtualFlight(Flight):
    """Flies an endpoint against a peer, whose line down is held here too; see the module's text."""

    def __init__(
        self,
        endpoint: TransmitterEndpoint,
        downlink: Line,
        peer: Peer,
        should_stop: Callable[[], bool] = lambda: False,
    ) -> None:
        super().__init__(endpoint, should_stop)
        self._downlink = downlink
        self._peer = peer
        self._arrivals: list[_Arrival] = []
        self._order = count()
        self._time_ns = 0
        self._deadline_ns: int | None = None
        self._greetings = 0

    def _now_ns(self) -> int:
        return self._time_ns

    def _may_ask(self) -> bool:
        # The handshake takes place before the flight's time begins, however long the line takes.
        self._greetings += 1
        return self._greetings <= GREETINGS_MAX

    def _await_answer(self) -> None:
        while self._arrivals:
            self._pass_to(self._arrivals[0].time_ns)

    def _begin(self) -> None:
        """Do nothing: the flight's time begins with its first tick."""

    def _rest(self) -> None:
        """Do nothing: all that can wait is done while the peer is waited for."""

    def _land(self) -> None:
        """Do nothing: no motor turns on this clock."""

    def _wait_until(self, due_ns: int) -> None:
        self._time_ns = due_ns
        self._pass_to(due_ns)

    def _linger(self) -> None:
        endpoint = self.endpoint
        terms = endpoint.node.session.terms
        line_ns = endpoint.uplink.line.longest_delay_ns + self._downlink.longest_delay_ns
        self._time_ns = endpoint.tick * terms.tick_ns + terms.linger_ns(line_ns)
        self._pass_to(self._time_ns, deadlines=False)

    def _send(self, messages: list[Delivery]) -> None:
        if messages:
            self._push(messages, upward=True)
            if not self.endpoint.greeting:
                self._pass_to(self._time_ns)

    def _send_past_line(self, message: bytes) -> None:
        self._step(self._time_ns, message)

    def _push(self, messages: list[Delivery], upward: bool) -> None:
        for arrival_ns, data in messages:
            heapq.heappush(self._arrivals, _Arrival(arrival_ns, next(self._order), upward, data))

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
                self._push(self.endpoint.take(arrival.data, arrival.time_ns), upward=True)

    def _step(self, time_ns: int, data: bytes | None) -> None:
        reply = self._peer.step(time_ns, data)
        # A peer in another process had it done while it was waited for.
        self.endpoint.node.flush_records()
        self._deadline_ns = reply.deadline_ns
        for message in reply.frames:
            self._push(self._downlink.carry(message, time_ns), upward=False)
        for leaves_ns, symbol in reply.later:
            self._push(self._downlink.carry(symbol, leaves_ns), upward=False)


RETRY_S = 0.25
"""A step is repeated after this silence; the receiver answers a repeated one from memory."""


class LinkPeer:
    """Steps a receiver over a link; LinkLost when it stays silent for `peer_timeout_s`.

    `meanwhile` is called while a reply is on its way.
    """

    def __init__(
        self,
        link: Link,
        peer_timeout_s: float,
        should_stop: Callable[[], bool] = lambda: False,
        meanwhile: Callable[[], None] = lambda: None,
    ) -> None:
        self._link = link
        self._peer_timeout_s = peer_timeout_s
        self._should_stop = should_stop
        self._meanwhile = meanwhile
        self._number = 0
        self._message = b""

    def keep_alive(self) -> None:
        """Repeat the last step, which changes nothing, so that a paused flight is not given up."""
        if self._message:
            self._link.send(self._message)

    def step(self, time_ns: int, data: bytes | None) -> Reply:
        """Send one step and wait for its reply."""
        self._number += 1
        message = self._message = encode_step(Step(self._number, time_ns, data))
        self._link.send(message)
        asked_at = time.monotonic()
        self._meanwhile()
        while True:
            answer = self._link.receive(RETRY_S)
            if answer is not None and is_envelope(answer):
                try:
                    reply = decode_reply(answer)
                except FrameError:
                    continue  # damaged on the way; silence repeats the step
                if reply.number == self._number:
                    return reply
                continue
            if self._should_stop():
                raise KeyboardInterrupt
            if time.monotonic() - asked_at > self._peer_timeout_s:
                raise LinkLost(
                    f"the receiver did not answer for {self._peer_timeout_s:g} s; is it running, "
                    "with the same session name, the other end of this endpoint and --clock virtual?"
                )
            if answer is None:
                self._link.send(message)
