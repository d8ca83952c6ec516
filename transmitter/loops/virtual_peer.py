"""The receiver's process, as the virtual flight steps it over a link."""

from __future__ import annotations

import time
from collections.abc import Callable

from channel.errors import FrameError, LinkLost
from channel.line.virtual import Reply, Step, decode_reply, encode_step, is_envelope
from channel.links.base import Link

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
