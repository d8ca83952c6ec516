"""What can be wrong with an end's own line: a port that went, a certificate that expired in flight."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from datetime import UTC, datetime

from channel.links.base import Link
from channel.links.security import Security

PEER_EXPIRED = "expired certificate"
"""As `channel.links.zenoh_gate` counts it."""


@dataclass(slots=True)
class Trouble:
    """Looks at a line when a flight was lost on it; made before, since certificates may be renewed."""

    link: Link
    security: Security | None
    refused: Counter[str]
    """connections that were turned away, by reason"""
    _expires: datetime | None = field(init=False, default=None)

    def __post_init__(self) -> None:
        if self.security is not None:
            from tenbaud.keys.authority import end_of

            self._expires = end_of(self.security.credentials.certificate.read_bytes())

    def text(self) -> str:
        """Return what is wrong, for a person; empty where nothing is known to be."""
        if told := self.link.trouble():
            return told
        if (
            self._expires is not None
            and self.security is not None
            and self._expires <= datetime.now(UTC)
        ):
            name = self.security.credentials.name
            return (
                f"the certificate of {name} expired in flight, at {self._expires:%Y-%m-%d %H:%M:%S} UTC; "
                f"where the authority is: `tenbaud keys renew {name}`, then copy its folder again"
            )
        if self.refused[PEER_EXPIRED]:
            return (
                "a node with an expired certificate was turned away; where the authority is, "
                "`tenbaud keys show` says whose it is, and `tenbaud keys renew NAME` renews it"
            )
        return ""
