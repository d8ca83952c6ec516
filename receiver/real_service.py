"""The controller node on the real clock. It has no tick: symbols drive it, and one timer per slot."""

from __future__ import annotations

import time
from collections.abc import Callable

from channel.clocks import SkewedClock
from channel.errors import ConfigMismatch, LinkLost
from channel.line import Line
from channel.links.base import Link
from channel.outbox import Outbox
from channel.virtual import is_envelope
from receiver.endpoint import ReceiverEndpoint
from receiver.session import Phase

POLL_S = 0.2
"""How often a quiet service looks whether it should stop."""

REFUSAL_LINGER_S = 1.0
"""How long a refused transmitter has to say in which fields it differs."""


def serve_real(
    endpoint: ReceiverEndpoint,
    link: Link,
    peer_timeout_s: float,
    should_stop: Callable[[], bool] = lambda: False,
    line: Line | None = None,
    clock: SkewedClock | None = None,
) -> None:
    """Serve one flight: take symbols as they come, erase slots as their deadlines pass.

    `line` is the downlink, whose flight time begins with the first message sent; `clock` what this
    end takes for the time.

    Raises LinkLost when nothing comes for `peer_timeout_s`, and ConfigMismatch when the peer flies
    on the virtual clock.
    """
    session = endpoint.session
    way_out = _WayOut(line or Line(), link)
    shown = clock.shown if clock is not None else lambda true_ns: true_ns
    reached = clock.reached if clock is not None else lambda shown_ns, _now_ns: shown_ns
    heard_ns = time.monotonic_ns()
    while session.phase is not Phase.ENDED and not should_stop():
        deadline_ns = session.next_deadline()
        due_ns = None if deadline_ns is None else reached(deadline_ns, time.monotonic_ns())
        data = link.receive(_patience_s(due_ns, way_out.next_due_ns))
        now_ns = time.monotonic_ns()
        messages: list[bytes] = []
        if data is not None:
            heard_ns = now_ns
            if is_envelope(data):
                raise ConfigMismatch(
                    "the transmitter flies on the virtual clock, this end on the real one; give "
                    "both the same --clock"
                )
            messages += endpoint.on_bytes(data, shown(now_ns))
        messages += endpoint.on_time(shown(now_ns))
        way_out.send(messages, now_ns)
        session.rest()
        quiet_s = (now_ns - heard_ns) / 1e9
        if session.refusal is not None and quiet_s > REFUSAL_LINGER_S:
            return
        if quiet_s > peer_timeout_s:
            raise LinkLost(
                f"nothing came from a transmitter for {peer_timeout_s:g} s; is it running, with "
                "the same session name and the other end of this endpoint?"
            )


class _WayOut:
    """The downlink: messages wait here until the line would have delivered them."""

    def __init__(self, line: Line, link: Link) -> None:
        self._line = line
        self._link = link
        self._outbox = Outbox()
        self._start_ns: int | None = None

    @property
    def next_due_ns(self) -> int | None:
        return self._outbox.next_due_ns

    def send(self, messages: list[bytes], now_ns: int) -> None:
        """Put messages on the line, and on the link what is due."""
        if messages and self._start_ns is None:
            self._start_ns = now_ns
        start_ns = self._start_ns or 0
        for message in messages:
            deliveries = self._line.carry(message, False, now_ns - start_ns)
            absolute = [one._replace(arrival_ns=one.arrival_ns + start_ns) for one in deliveries]
            self._outbox.put(absolute, False)
        for data, _ in self._outbox.take(now_ns):
            self._link.send(data)


def _patience_s(*due_ns: int | None) -> float:
    now_ns = time.monotonic_ns()
    waits = [(due - now_ns) / 1e9 for due in due_ns if due is not None]
    return min([POLL_S, *(max(0.0, wait) for wait in waits)])
