"""The controller node on the virtual clock: answers the transmitter's steps until the flight ends."""

from __future__ import annotations

import time
from collections.abc import Callable

from channel.errors import ConfigMismatch, FrameError, LinkLost
from channel.links.base import Link
from channel.virtual import decode_step, encode_reply, is_envelope
from receiver.endpoint import ReceiverEndpoint
from receiver.real_service import POLL_S, REFUSAL_LINGER_S
from receiver.session import Phase


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
    last_number = -1
    last_reply = b""
    quiet_since = time.monotonic()
    while endpoint.session.phase is not Phase.ENDED and not should_stop():
        data = link.receive(POLL_S)
        if data is None:
            quiet_s = time.monotonic() - quiet_since
            if endpoint.session.refusal is not None and quiet_s > REFUSAL_LINGER_S:
                return
            if quiet_s > peer_timeout_s:
                raise LinkLost(
                    f"no message from a transmitter for {peer_timeout_s:g} s; is it running, with "
                    "the same session name and the other end of this endpoint?"
                )
            continue
        quiet_since = time.monotonic()
        if not is_envelope(data):
            raise ConfigMismatch(
                "the transmitter flies on the real clock, this end on the virtual one; give both "
                "the same --clock"
            )
        try:
            step = decode_step(data)
        except FrameError as error:
            endpoint.session.on_malformed(str(error))
            continue
        if step.number != last_number:
            reply = endpoint.step(step.time_ns, step.data)
            last_number, last_reply = step.number, encode_reply(reply._replace(number=step.number))
        link.send(last_reply)
        endpoint.session.rest()
        meanwhile()
