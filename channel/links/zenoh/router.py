"""A Zenoh router inside this process, for two ends that cannot reach each other but both reach it.

It forwards between the ends and holds no key of theirs: it sees symbols and commands in the clear, and
is trusted with them. With `security` it lets each end send and hear what its part needs, no more.
"""

from __future__ import annotations

from collections import Counter
from contextlib import ExitStack
from typing import Self

from channel.errors import LinkError
from channel.links.endpoints import check_endpoints
from channel.links.security import Security
from channel.links.zenoh.config import (
    SESSIONS_MAX,
    as_file,
    close_session,
    open_session,
    zenoh_config,
    zenoh_settings,
)
from channel.links.zenoh.gate import Gate


def router_file(
    listen: tuple[str, ...], security: Security | None, connections_max: int = SESSIONS_MAX
) -> str:
    """Return the settings of such a router as a file for a stand-alone one."""
    return as_file(_settings(listen, security, connections_max))


def _settings(
    listen: tuple[str, ...], security: Security | None, connections_max: int
) -> dict[str, object]:
    return zenoh_settings("router", listen, (), security=security, connections_max=connections_max)


class ZenohRouter:
    """Within a `with`, routes between the nodes that connect to `listen`; LinkError if it cannot."""

    def __init__(
        self,
        listen: tuple[str, ...],
        *,
        security: Security | None = None,
        insecure: bool = False,
        connections_max: int = SESSIONS_MAX,
    ) -> None:
        if not listen:
            raise LinkError("a router needs an endpoint to listen on")
        check_endpoints(listen, insecure, security is not None)
        self.refused: Counter[str] = Counter()
        """nodes turned away, by reason"""
        settings = _settings(listen, security, connections_max)
        self._session = open_session(zenoh_config(settings), ", ".join(listen))
        self._parts = ExitStack()
        self._parts.callback(close_session, self._session)
        self._parts.callback(Gate(self._session, security, self.refused).close)

    @property
    def connected(self) -> int:
        return len(list(self._session.info.transports()))

    def close(self) -> None:
        self._parts.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
