"""Opens this end's Zenoh session: addresses checked, every setting given, access confined."""

from __future__ import annotations

import re
from collections.abc import Callable

import zenoh

from channel.errors import LinkError
from channel.links.endpoints import check_endpoints
from channel.links.kind import NodePlace
from channel.links.security import Security
from channel.links.zenoh.config import SESSIONS_MAX, open_session, zenoh_config, zenoh_settings

_NAME = re.compile(r"[A-Za-z0-9_.-]+(/[A-Za-z0-9_.-]+)*")


def is_session_name(name: str) -> bool:
    """Return whether a session may have this name; names become keys, file names and printed text."""
    return bool(_NAME.fullmatch(name)) and not {".", ".."} & set(name.split("/"))


class NodeOptions(NodePlace, total=False):
    """All that `open_node` takes."""

    patience_s: float
    should_stop: Callable[[], bool]
    connections_max: int


def open_node(
    *,
    listen: tuple[str, ...] = (),
    connect: tuple[str, ...] = (),
    router: tuple[str, ...] = (),
    scouting: bool = False,
    insecure: bool = False,
    security: Security | None = None,
    patience_s: float = 10.0,
    should_stop: Callable[[], bool] = lambda: False,
    connections_max: int = SESSIONS_MAX,
) -> zenoh.Session:
    """Return an open session; LinkError where the addresses cannot be used.

    `listen` and `connect` are Zenoh endpoints. `router` are endpoints of Zenoh routers instead, behind
    which the other end is; the first that answers within `patience_s` is taken. `scouting` finds
    listening ends by multicast. `security`: TLS, and only the invited; without it an address beyond
    this machine needs `insecure`.
    """
    where = listen + connect + router
    if not where and not scouting:
        raise LinkError("a Zenoh link needs an endpoint to listen on or to connect to")
    if router and (listen or connect or scouting):
        raise LinkError("behind a router an end neither listens nor connects elsewhere")
    check_endpoints(where, insecure, security is not None, scouting)
    # Only clients hear each other through a router: what peers send it stays there.
    settings = zenoh_settings(
        "client" if router else "peer",
        listen,
        connect or router,
        scouting=scouting,
        security=security,
        connections_max=connections_max,
    )
    patience_s = patience_s if router else 0.0
    return open_session(zenoh_config(settings), ", ".join(where), patience_s, should_stop)
