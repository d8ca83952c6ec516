"""The sensor node on the real clock: every tick at its absolute deadline.

The time until the next deadline is spent taking frames in, so that a tick itself only reads, sends
and writes. A tick is `floor((t - t0) / h)`: after a pause the ticks that passed are gone, their slots
become erasures at the receiver, and nothing is sent in a burst afterwards. A loop that is behind its
ticks still takes in what has come before it goes on: without the echoes it could never catch up.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable

from channel.errors import ConfigMismatch, LinkLost
from channel.line.line import Delivery, Outbox
from channel.line.virtual import is_envelope
from channel.links.base import Link
from channel.protocol.events import Event, EventKind, Presence
from transmitter.endpoint import TransmitterEndpoint, TransmitterNode
from transmitter.guard import GuardCause, GuardReason
from transmitter.loops.flight import Flight
from transmitter.session.rejoin import ASK_AGAIN_NS
from transmitter.session.session import Phase

HELLO_PERIOD_NS = 200_000_000
"""Longest time between two requests for a session."""
LEAD_IN_NS = 20_000_000
"""Between the handshake and tick 0."""
LAST_ECHO_NS = 1_000_000_000
"""How much later than agreed the last echo may come, when no other can make up for it."""
OLD_ANSWERS_MAX = 5
"""Answers that are too old to begin on before the flight begins on one all the same."""
CATCH_UP_MESSAGES_MAX = 64
"""Messages taken in a row by a loop that is behind its ticks."""


class RampDown:
    """Takes a node's motors to their safe voltage; for a rig that does not ask for it, nothing.

    A body that hovers and loses its lift at once drops by as much as its stand allows, so the voltages
    go down along the guard's ramp. `tick` is the first one that was not flown.
    """

    def __init__(self, node: TransmitterNode, tick: int) -> None:
        self._node = node
        self._tick = tick
        self._tick_ns = node.session.terms.tick_ns
        self.over = not node.rig.ramps_down or node.latched
        if not self.over:
            node.guard.trip(GuardReason(GuardCause.FLIGHT_OVER))

    @property
    def next_ns(self) -> int:
        """Return the flight time at which `step` has something to do."""
        return sys.maxsize if self.over else self._tick * self._tick_ns

    def step(self, now_ns: int) -> None:
        """Write the voltages of a tick that is due."""
        if self.over or now_ns < self.next_ns:
            return
        self._node.rig.write(self._tick, self._node.guard.apply(self._tick, None))
        self._tick = max(self._tick, now_ns // self._tick_ns) + 1
        self.over = self._node.latched


class RealFlight(Flight):
    """Flies an endpoint over a link in real time; see the module's text."""

    def __init__(
        self,
        endpoint: TransmitterEndpoint,
        link: Link,
        peer_timeout_s: float,
        should_stop: Callable[[], bool] = lambda: False,
    ) -> None:
        super().__init__(endpoint, should_stop)
        self._link = link
        self._peer_timeout_s = peer_timeout_s
        self._outbox = Outbox()
        self._start_ns = time.monotonic_ns()
        self._asked_ns: int | None = None
        """when a session was asked for first"""
        self._hello = (0, b"")
        """when the last request left, and its message"""
        self._welcome = b""
        self._is_answered = self._has_begun = False
        self._old_answers = 0
        self._peer_reported = True
        """presence of the receiver as last reported"""
        terms = endpoint.node.session.terms
        self._tick_ns = terms.tick_ns
        self._ramp_down: RampDown | None = None
        self._ask_again_ns = min(max(terms.sample_ns, ASK_AGAIN_NS), HELLO_PERIOD_NS)

    def _now_ns(self) -> int:
        return time.monotonic_ns() - self._start_ns

    def _may_ask(self) -> bool:
        now_ns = self._now_ns()
        if self._asked_ns is None:
            self._asked_ns = now_ns
        if now_ns - self._asked_ns > self._peer_timeout_s * 1e9:
            raise LinkLost(
                f"no receiver answered for {self._peer_timeout_s:g} s; is it running, with the same "
                "session name, the other end of this endpoint and --clock real?"
            )
        return not self._should_stop()

    def _await_answer(self) -> None:
        until_ns = self._now_ns() + self._ask_again_ns
        self._is_answered = False
        while not self._is_answered and (left_ns := until_ns - self._now_ns()) > 0:
            self._take_in(left_ns / 1e9)
        self._send_due()

    def _needs_answer(self) -> bool:
        """Return whether there is no answer, or one so old that the receiver expects symbols by now."""
        if self.endpoint.greeting:
            return True
        flying = self.endpoint.node.session.phase is Phase.FLYING
        too_old = flying and (not self._is_answered or self._now_ns() > self._latest_start_ns)
        self._old_answers += too_old
        return too_old and self._old_answers <= OLD_ANSWERS_MAX

    @property
    def _latest_start_ns(self) -> int:
        """Return when the flight has to begin at the latest, on a line that brings no whole slots."""
        within_ns, terms = self._link.start_ns, self.endpoint.node.session.terms
        if within_ns is None:
            return sys.maxsize
        left_ns, hello = self._hello
        size = self._link.wire.size
        lines_ns = size(hello) * terms.uplink_line_ns + size(self._welcome) * terms.downlink_byte_ns
        return left_ns + lines_ns + within_ns

    def _begin(self) -> None:
        # A process that is held up here misses its first ticks: the receiver counts from its answer.
        begins_ns = min(self._now_ns() + LEAD_IN_NS, self._latest_start_ns)
        self._has_begun = True
        self._start_ns += begins_ns - self.endpoint.tick * self._tick_ns

    def _rest(self) -> None:
        endpoint = self.endpoint
        endpoint.node.flush_records()
        self._watch_peer()
        self._watch_rate(endpoint.tick - 1)

    def _linger(self) -> None:
        session = self.endpoint.node.session
        ramp_down = self._ramp_down = RampDown(self.endpoint.node, self.endpoint.tick)
        agreed_ns = session.terms.linger_ns(self.endpoint.uplink.line.longest_delay_ns)
        until_ns = self._now_ns() + agreed_ns + LAST_ECHO_NS
        while (now_ns := self._now_ns()) < until_ns:
            if session.phase is not Phase.FLYING or (session.lag_samples == 0 and not self._outbox):
                break
            ramp_down.step(now_ns)
            self._take_in((min(until_ns, ramp_down.next_ns) - self._now_ns()) / 1e9)
        # The answer to the last echo: the report of a difference.
        self._send_due()

    def _land(self) -> None:
        ramp_down = self._ramp_down
        while ramp_down is not None and not ramp_down.over:
            ramp_down.step(self._now_ns())
            self._take_in_until(min(ramp_down.next_ns, self._now_ns() + self._tick_ns))

    def _wait_until(self, due_ns: int) -> None:
        self._take_in_until(due_ns)
        if self._now_ns() - due_ns >= self._tick_ns:
            self._catch_up()

    def _take_in_until(self, due_ns: int) -> None:
        while (left_ns := due_ns - self._now_ns()) > 0:
            if self._answer_due:
                self._take_in(left_ns / 1e9)
            elif not self._take_in(0.0):
                # Nothing is on its way that could matter before the deadline, and a plain sleep
                # keeps it better than waiting for a message that does not come.
                sending_ns = self._outbox.next_due_ns
                wake_ns = due_ns if sending_ns is None else min(due_ns, sending_ns)
                time.sleep(max(0.0, wake_ns - self._now_ns()) / 1e9)

    def _catch_up(self) -> None:
        """Take in arrived messages, within bounds: a flood of messages must not stop the ticks."""
        for _ in range(CATCH_UP_MESSAGES_MAX):
            if not self._take_in(0.0):
                return

    @property
    def _answer_due(self) -> bool:
        session = self.endpoint.node.session
        return session.phase is not Phase.FLYING or session.lag_samples > 0

    def _take_in(self, timeout_s: float) -> bool:
        """Send what is due and take one message, waiting for either at most `timeout_s`.

        Return whether a message came.
        """
        self._send_due()
        due_ns = self._outbox.next_due_ns
        if due_ns is not None:
            timeout_s = max(0.0, min(timeout_s, (due_ns - self._now_ns()) / 1e9))
        data = self._link.receive(timeout_s)
        if data is None:
            return False
        if is_envelope(data):
            raise ConfigMismatch(
                "the receiver flies on the virtual clock, this end on the real one; give both the "
                "same --clock"
            )
        if self.endpoint.greeting:
            self._welcome = data
        self._outbox.put(self.endpoint.take(data, self._now_ns()))
        # Another answer to the same request is the same message.
        self._is_answered = not self.endpoint.greeting and data == self._welcome
        return True

    def _send(self, messages: list[Delivery]) -> None:
        self._outbox.put(messages)
        self._send_due()

    def _send_due(self) -> None:
        for message in self._outbox.take(self._now_ns()):
            if self._has_begun:
                self._link.send(message)
                continue
            leaves_ns, before = self._now_ns(), self._link.counts.messages_out
            self._link.send(message)
            if self._link.counts.messages_out > before:
                self._hello = leaves_ns, message

    def _send_past_line(self, message: bytes) -> None:
        self._link.send(message)

    def _watch_rate(self, tick: int) -> None:
        event = self.endpoint.rate.look(tick, self.endpoint.node.session)
        if event is not None:
            self.endpoint.node.tell(event)

    def _watch_peer(self) -> None:
        present = self._link.peer_present()
        if present is not self._peer_reported:
            self._peer_reported = present
            cause = Presence.BACK if present else Presence.GONE
            self.endpoint.node.tell(Event(EventKind.PEER, cause=cause))
