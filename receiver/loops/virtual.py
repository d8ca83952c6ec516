"""The controller node on the virtual clock: answers the transmitter's steps until the flight ends."""

from __future__ import annotations

import time
from collections.abc import Callable

from channel.errors import ConfigMismatch, FrameError
from channel.line.virtual import decode_step, encode_reply, is_envelope
from channel.links.base import Link
from receiver.endpoint import ReceiverEndpoint
from receiver.loops.service import POLL_S, Service
from receiver.session.session import Phase


class VirtualService(Service):
    """Serves one flight, without a link: steps in, replies out. Times are of the monotonic clock."""

    missed = "no message"

    def __init__(self, endpoint: ReceiverEndpoint, peer_timeout_s: float) -> None:
        super().__init__(endpoint, peer_timeout_s)
        self._last_number = -1
        self._last_reply = b""

    def next_due_ns(self, now_ns: int) -> int | None:
        """Return None: the transmitter's process keeps the time."""
        return None

    def take(self, data: bytes | None, now_ns: int) -> list[bytes]:
        """Take one step, or none; return its reply. A repeated step gets the same one.

        Raises ConfigMismatch when the peer flies on the real clock.
        """
        if data is None:
            return []
        self._heard_ns = now_ns
        if not is_envelope(data):
            raise ConfigMismatch(
                "the transmitter flies on the real clock, this end on the virtual one; give both "
                "the same --clock"
            )
        try:
            step = decode_step(data)
        except FrameError as error:
            self.endpoint.session.on_malformed(str(error))
            return []
        if step.number != self._last_number:
            reply = self.endpoint.step(step.time_ns, step.data)
            self._last_number = step.number
            self._last_reply = encode_reply(reply._replace(number=step.number))
        return [self._last_reply]


def serve_virtual(
    endpoint: ReceiverEndpoint,
    link: Link,
    peer_timeout_s: float,
    should_stop: Callable[[], bool] = lambda: False,
    meanwhile: Callable[[], None] = lambda: None,
) -> None:
    """Serve steps until the session ends, or is refused and the transmitter has gone.

    `meanwhile` is called when a reply has been sent. Raises LinkLost when no step comes for
    `peer_timeout_s` of wall-clock time, and ConfigMismatch when the peer flies on the real clock.
    """
    service = VirtualService(endpoint, peer_timeout_s)
    while endpoint.session.phase is not Phase.ENDED and not should_stop():
        data = link.receive(POLL_S)
        for message in service.take(data, time.monotonic_ns()):
            link.send(message)
        endpoint.session.rest()
        meanwhile()
        if data is None and service.over(time.monotonic_ns()):
            return
