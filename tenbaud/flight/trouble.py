"""Faults of an end's own line: a lost port, a certificate that expired in flight."""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Callable

from channel.links.base import Link
from channel.links.security import Security
from tenbaud.flight.outcome import ExitCode, Outcome, first_cause

PEER_EXPIRED = "expired certificate"
"""As `channel.links.zenoh.gate` counts it."""


class Certificate:
    """This end's certificate as it was at the start; a renewed one is used from the next start on.

    Zenoh closes a connection when the certificate of the side that connected expires, but not for that
    of the side that listens. So an end stops by itself when its own has expired.
    """

    def __init__(self, security: Security | None) -> None:
        self._name = ""
        self._end_s = math.inf
        if security is not None:
            from tenbaud.keys.authority import end_of

            self._name = security.credentials.name
            self._end_s = end_of(security.credentials.certificate.read_bytes()).timestamp()

    def expired(self) -> bool:
        return time.time() >= self._end_s

    def text(self) -> str:
        when = time.strftime("%Y-%m-%d %H:%M:%S", time.gmtime(self._end_s))
        return (
            f"the certificate of {self._name} expired in flight, at {when} UTC; where the authority "
            f"is, renew it with `tenbaud keys renew {self._name}` and copy its folder again"
        )


class Trouble:
    """Watches over one end's line from the opening of its link until its outcome is known."""

    def __init__(
        self,
        link: Link,
        security: Security | None,
        refused: Counter[str],
        asked_to_stop: Callable[[], bool],
    ) -> None:
        self._link = link
        self._refused = refused
        self._asked_to_stop = asked_to_stop
        self._certificate = Certificate(security)

    def should_stop(self) -> bool:
        """Return whether the flight is to be ended: it was asked to, or may not go on."""
        return self._asked_to_stop() or self._certificate.expired()

    def first_cause(self, outcome: Outcome, consequence: str = "") -> Outcome:
        """Return the outcome, with the fault of the line as its cause where that came first."""
        expired = self._certificate.expired()
        if expired and outcome.code is ExitCode.INTERRUPTED and not self._asked_to_stop():
            outcome = Outcome(ExitCode.LINK_LOST, outcome.text)
        return first_cause(outcome, self._text(expired), consequence)

    def _text(self, expired: bool) -> str:
        if trouble := self._link.trouble():
            return trouble
        if expired:
            return self._certificate.text()
        if self._refused[PEER_EXPIRED]:
            return (
                "a node with an expired certificate was turned away; where the authority is, "
                "`tenbaud keys show` says whose it is, and `tenbaud keys renew NAME` renews it"
            )
        return ""
