"""The controller node on the real clock. It has no tick: symbols drive it, and one timer per slot."""

from __future__ import annotations

import time
from collections.abc import Callable

from channel.errors import ConfigMismatch, LinkLost
from channel.links.base import Link
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
) -> None:
    """Serve one flight: take symbols as they come, erase slots as their deadlines pass.

    Raises LinkLost when nothing comes for `peer_timeout_s`, and ConfigMismatch when the peer flies
    on the virtual clock.
    """
    session = endpoint.session
    heard_ns = time.monotonic_ns()
    while session.phase is not Phase.ENDED and not should_stop():
        data = link.receive(_patience_s(session.next_deadline()))
        now_ns = time.monotonic_ns()
        messages: list[bytes] = []
        if data is not None:
            heard_ns = now_ns
            if is_envelope(data):
                raise ConfigMismatch(
                    "the transmitter flies on the virtual clock, this end on the real one; give "
                    "both the same --clock"
                )
            messages += endpoint.on_bytes(data, now_ns)
        messages += endpoint.on_time(now_ns)
        for message in messages:
            link.send(message)
        quiet_s = (now_ns - heard_ns) / 1e9
        if session.refusal is not None and quiet_s > REFUSAL_LINGER_S:
            return
        if quiet_s > peer_timeout_s:
            raise LinkLost(
                f"nothing came from a transmitter for {peer_timeout_s:g} s; is it running, with "
                "the same session name and the other end of this endpoint?"
            )


def _patience_s(deadline_ns: int | None) -> float:
    if deadline_ns is None:
        return POLL_S
    return min(POLL_S, max(0.0, (deadline_ns - time.monotonic_ns()) / 1e9))
