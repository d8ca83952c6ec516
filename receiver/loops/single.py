"""The controller node of one rig, driven by messages and one timer per slot. It has no tick."""

from __future__ import annotations

import time
from collections.abc import Callable

from channel.links.base import Link
from receiver.endpoint import ReceiverEndpoint

POLL_S = 0.2
"""How often a quiet service looks whether it should stop."""


def serve(
    endpoint: ReceiverEndpoint,
    link: Link,
    peer_timeout_s: float,
    should_stop: Callable[[], bool] = lambda: False,
    meanwhile: Callable[[], None] = lambda: None,
) -> None:
    """Serve one flight on either clock, until it ends or is refused and the transmitter has gone.

    `meanwhile` is called when the answers have been sent. Raises LinkLost when nothing comes for
    `peer_timeout_s`, and ConfigMismatch when the peer flies on the other clock.
    """
    now_ns = time.monotonic_ns()
    while not endpoint.over(now_ns, peer_timeout_s) and not should_stop():
        due_ns = endpoint.next_due_ns(now_ns)
        patience_s = POLL_S if due_ns is None else min(POLL_S, max(0.0, (due_ns - now_ns) / 1e9))
        data = link.receive(patience_s)
        now_ns = time.monotonic_ns()
        for message in endpoint.take(data, now_ns):
            link.send(message)
        endpoint.session.flush_records()
        meanwhile()
