"""The controller node on the real clock. It has no tick: symbols drive it, and one timer per slot."""

from __future__ import annotations

import time
from collections.abc import Callable

from channel.errors import ConfigMismatch
from channel.line.clocks import SkewedClock
from channel.line.line import Line
from channel.line.outbox import Outbox
from channel.line.virtual import is_envelope
from channel.links.base import Link
from receiver.endpoint import ReceiverEndpoint
from receiver.loops.service import POLL_S, Service
from receiver.session.session import Phase


class RealService(Service):
    """Serves one flight, without a link: messages and times in, messages out.

    `line` is the downlink, whose flight time begins with the first message sent; `clock` what this
    end takes for the time. All times are of the monotonic clock.
    """

    missed = "nothing came"

    def __init__(
        self,
        endpoint: ReceiverEndpoint,
        peer_timeout_s: float,
        line: Line | None = None,
        clock: SkewedClock | None = None,
    ) -> None:
        super().__init__(endpoint, peer_timeout_s)
        self._line = line or Line()
        self._at_once = self._line.at_once
        self._clock = clock
        self._outbox = Outbox()
        self._line_start_ns: int | None = None

    def next_due_ns(self, now_ns: int) -> int | None:
        """Return when there is something to do without a message; None: nothing is planned."""
        due_ns = self.endpoint.session.next_deadline()
        if due_ns is not None and self._clock is not None:
            due_ns = self._clock.reached(due_ns, now_ns)
        sending_ns = self._outbox.next_due_ns
        if due_ns is None or sending_ns is None:
            return sending_ns if due_ns is None else due_ns
        return min(due_ns, sending_ns)

    def take(self, data: bytes | None, now_ns: int) -> list[bytes]:
        """Take a message, or none, and let time pass to `now_ns`; return what is to be sent now.

        Raises ConfigMismatch when the peer flies on the virtual clock.
        """
        shown_ns = now_ns if self._clock is None else self._clock.shown(now_ns)
        messages: list[bytes] = []
        if data is not None:
            self._heard_ns = now_ns
            if is_envelope(data):
                raise ConfigMismatch(
                    "the transmitter flies on the virtual clock, this end on the real one; give "
                    "both the same --clock"
                )
            messages += self.endpoint.on_bytes(data, shown_ns)
        messages += self.endpoint.on_time(shown_ns)
        return self._on_line(messages, now_ns)

    def _on_line(self, messages: list[bytes], now_ns: int) -> list[bytes]:
        """Put messages on the line; return those that it has delivered by now."""
        if self._at_once:
            return messages
        if messages and self._line_start_ns is None:
            self._line_start_ns = now_ns
        start_ns = self._line_start_ns or 0
        for message in messages:
            deliveries = self._line.carry(message, False, now_ns - start_ns)
            absolute = [one._replace(arrival_ns=one.arrival_ns + start_ns) for one in deliveries]
            self._outbox.put(absolute, False)
        return [data for data, _ in self._outbox.take(now_ns)]


def serve_real(
    endpoint: ReceiverEndpoint,
    link: Link,
    peer_timeout_s: float,
    should_stop: Callable[[], bool] = lambda: False,
    line: Line | None = None,
    clock: SkewedClock | None = None,
) -> None:
    """Serve one flight: take symbols as they come, erase slots as their deadlines pass.

    Raises LinkLost when nothing comes for `peer_timeout_s`, and ConfigMismatch when the peer flies
    on the virtual clock.
    """
    service = RealService(endpoint, peer_timeout_s, line, clock)
    while endpoint.session.phase is not Phase.ENDED and not should_stop():
        now_ns = time.monotonic_ns()
        due_ns = service.next_due_ns(now_ns)
        patience_s = POLL_S if due_ns is None else min(POLL_S, max(0.0, (due_ns - now_ns) / 1e9))
        data = link.receive(patience_s)
        now_ns = time.monotonic_ns()
        for message in service.take(data, now_ns):
            link.send(message)
        endpoint.session.rest()
        if service.over(now_ns):
            return
