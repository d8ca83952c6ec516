"""The sensor node on the real clock: every tick at its absolute deadline.

The time until the next deadline is spent taking frames in, so that a tick itself only reads, sends
and writes. A tick is `floor((t - t0) / h)`: after a pause the ticks that passed are gone, their slots
become erasures at the receiver, and nothing is sent in a burst afterwards. A loop that is behind its
ticks still takes in what has come before it goes on: without the echoes it could never catch up.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

from channel.errors import ConfigMismatch, LinkLost
from channel.line.inlet import Inlet
from channel.line.lateness import LatenessMeter
from channel.line.outbox import Outbox
from channel.line.uplink import Uplink
from channel.line.virtual import is_envelope
from channel.links.base import Link
from channel.protocol.endings import End
from channel.protocol.events import Event, EventKind, Presence
from channel.protocol.frames import Frame, Symbol
from transmitter.loops.ramp_down import Landing
from transmitter.node import TransmitterNode
from transmitter.session.rate_watch import RateWatch
from transmitter.session.rejoin import ASK_AGAIN_NS
from transmitter.session.session import Phase

HELLO_PERIOD_S = 0.2
"""Longest time between two requests for a session."""
LEAD_IN_NS = 20_000_000
"""Between the handshake and tick 0."""
CATCH_UP_MESSAGES_MAX = 64
"""Messages taken in a row by a loop that is behind its ticks."""


class RealFlight:
    """Flies a node over a link in real time; see the module's text."""

    def __init__(
        self,
        node: TransmitterNode,
        uplink: Uplink,
        link: Link,
        should_stop: Callable[[], bool] = lambda: False,
    ) -> None:
        self._node = node
        self._uplink = uplink
        self._link = link
        self._should_stop = should_stop
        self._outbox = Outbox()
        self._start_ns = 0
        self._peer_told = True
        """what was last told about the receiver: it is there"""
        self.lateness = LatenessMeter()
        self.rate = RateWatch(node.session.terms)
        self.ticks_missed = 0
        self.inlet = Inlet(uplink.wire, node.on_malformed)

    def greet(self, peer_timeout_s: float) -> None:
        """Ask for a session until there is one or a refusal; LinkLost when nobody answers."""
        session = self._node.session
        self._start_ns = asked_ns = time.monotonic_ns()
        next_hello_ns = asked_ns
        period_ns = min(max(session.terms.sample_ns, ASK_AGAIN_NS), round(HELLO_PERIOD_S * 1e9))
        while session.phase is Phase.GREETING and session.refusal is None:
            now_ns = time.monotonic_ns()
            if self._should_stop():
                return
            if now_ns - asked_ns > peer_timeout_s * 1e9:
                raise LinkLost(
                    f"no receiver answered for {peer_timeout_s:g} s; is it running, with the same "
                    "session name, the other end of this endpoint and --clock real?"
                )
            if now_ns >= next_hello_ns:
                self._offer([session.hello()])
                next_hello_ns = now_ns + period_ns
            self._take_in(period_ns / 1e9)
        self._send_due()

    def run(self, ticks: int) -> int:
        """Fly so many ticks, or until the end of the rig or the safe voltage; return the tick reached.

        The first tick is that of the session's first sample, which is not 0 when the receiver has
        been flying before.
        """
        node = self._node
        tick_ns = node.session.terms.tick_ns
        tick = first = node.session.epoch_tick
        self._start_ns = time.monotonic_ns() + LEAD_IN_NS - first * tick_ns
        while tick < first + ticks and not node.over:
            if self._should_stop():
                node.stop()
            self._wait_until(tick * tick_ns)
            if self._now_ns() - tick * tick_ns >= tick_ns:
                self._catch_up()
            now_ns = self._now_ns()
            lateness_ns = now_ns - tick * tick_ns
            if lateness_ns >= tick_ns:
                missed = lateness_ns // tick_ns
                self.ticks_missed += missed
                tick += missed
            self.lateness.add(lateness_ns)
            frames = node.measure(tick)
            if frames is None:
                return tick
            self._offer(frames)
            self._send_due()
            node.actuate(tick, lateness_ns)
            node.rest()
            self._watch_peer()
            self._watch_rate(tick)
            tick += 1
        return tick

    def finish(self, tick: int, farewell: Callable[[], End]) -> None:
        """Let the last echoes come in, end the session on both sides, take a real rig's motors down.

        `tick` is the first one that was not flown, as `run` returns it; `farewell` is asked for what
        the receiver is told once the echoes are in.
        """
        terms = self._node.session.terms
        linger_ns = (
            terms.uplink_delivery_ns
            + terms.symbol_delay_ns
            + terms.downlink_budget_ns
            + terms.deadline_allowance_ns
            + self._uplink.line.longest_delay_ns
            + terms.uplink_line_ns
            + terms.downlink_line_ns
        )
        landing = Landing(self._node, tick)
        until_ns = self._now_ns() + linger_ns
        copies = self._node.session.copies
        while self._node.session.phase is Phase.FLYING and self._now_ns() < until_ns:
            if copies.lag_samples == 0 and not self._outbox:
                break
            landing.step(self._now_ns())
            self._take_in((min(until_ns, landing.next_ns) - self._now_ns()) / 1e9)
        # What the last echo was answered with: the report of a difference.
        self._send_due()
        self._node.rest()
        self.leave(farewell())
        while not landing.over:
            landing.step(self._now_ns())
            self._wait_until(min(landing.next_ns, self._now_ns() + terms.tick_ns))

    def leave(self, end: End) -> None:
        """End the session on both sides at once; before the first tick nothing else is to be done."""
        # The farewell is spared the line's delay: this process is about to end.
        for frame in self._node.session.bye(end):
            self._link.send(self._uplink.counted(frame)[0])

    def _now_ns(self) -> int:
        return time.monotonic_ns() - self._start_ns

    def _wait_until(self, deadline_ns: int) -> None:
        while (left_ns := deadline_ns - self._now_ns()) > 0:
            if self._answer_due:
                self._take_in(left_ns / 1e9)
            elif not self._take_in(0.0):
                # Nothing is on its way that could matter before the deadline, and a plain sleep
                # keeps it better than waiting for a message that does not come.
                due_ns = self._outbox.next_due_ns
                wake_ns = deadline_ns if due_ns is None else min(deadline_ns, due_ns)
                time.sleep(max(0.0, wake_ns - self._now_ns()) / 1e9)

    def _catch_up(self) -> None:
        """Take in what has come, within bounds: whoever floods this end must not stop its ticks."""
        for _ in range(CATCH_UP_MESSAGES_MAX):
            if not self._take_in(0.0):
                return

    @property
    def _answer_due(self) -> bool:
        session = self._node.session
        return session.phase is not Phase.FLYING or session.copies.lag_samples > 0

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
        frame = self.inlet.take(data)
        if frame is not None:
            self._offer(self._node.deliver(frame))
        return True

    def _offer(self, frames: Sequence[Frame]) -> None:
        for frame in frames:
            deliveries = self._uplink.offer(frame, self._now_ns())
            self._outbox.put(deliveries, isinstance(frame, Symbol))

    def _send_due(self) -> None:
        for data, is_symbol in self._outbox.take(self._now_ns()):
            self._link.send(data, is_symbol)

    def _watch_rate(self, tick: int) -> None:
        event = self.rate.look(tick, self._node.session)
        if event is not None:
            self._node.tell(event)

    def _watch_peer(self) -> None:
        present = self._link.peer_present()
        if present is not self._peer_told:
            self._peer_told = present
            cause = Presence.BACK if present else Presence.GONE
            self._node.tell(Event(EventKind.PEER, cause=cause))
