"""What a service knows on either clock: when it heard from the transmitter, and when it is over."""

from __future__ import annotations

import time
from abc import ABC, abstractmethod

from channel.errors import LinkLost
from receiver.endpoint import ReceiverEndpoint
from receiver.session.session import Phase

POLL_S = 0.2
"""How often a quiet service looks whether it should stop."""

REFUSAL_LINGER_S = 1.0
"""How long a refused transmitter has to say in which fields it differs."""


class Service(ABC):
    """Serves one flight, without a link: messages and times in, messages out.

    All times are of the monotonic clock.
    """

    missed: str
    """what did not come when a transmitter is silent, for the error's text"""

    def __init__(self, endpoint: ReceiverEndpoint, peer_timeout_s: float) -> None:
        self.endpoint = endpoint
        self._peer_timeout_s = peer_timeout_s
        self._heard_ns = time.monotonic_ns()

    @abstractmethod
    def next_due_ns(self, now_ns: int) -> int | None:
        """Return when there is something to do without a message; None: nothing is planned."""

    @abstractmethod
    def take(self, data: bytes | None, now_ns: int) -> list[bytes]:
        """Take a message, or none, and let time pass to `now_ns`; return what is to be sent now."""

    def over(self, now_ns: int) -> bool:
        """Return whether the flight is over; LinkLost when nothing came for too long."""
        session = self.endpoint.session
        quiet_s = (now_ns - self._heard_ns) / 1e9
        if session.phase is Phase.ENDED:
            return True
        if session.refusal is not None and quiet_s > REFUSAL_LINGER_S:
            return True
        if quiet_s > self._peer_timeout_s:
            raise LinkLost(
                f"{self.missed} from a transmitter for {self._peer_timeout_s:g} s; is it running, with "
                "the same session name and the other end of this endpoint?"
            )
        return False
