"""Zenoh's settings, all relevant ones explicit: its defaults bind all interfaces and scout."""

from __future__ import annotations

import json
import re
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Literal

import zenoh

from channel.errors import LinkError, LinkLost
from channel.links.endpoints import check_endpoints
from channel.links.kind import NodePlace
from channel.links.security import Security, security_settings

LEASE_MS = 2_000
RETRY = {"period_init_ms": 50, "period_max_ms": 500, "period_increase_factor": 2}
SESSIONS_MAX = 64
"""Connections that a node takes; without a certificate none."""
OPEN_AGAIN_S = 0.2

Mode = Literal["peer", "client", "router"]


def zenoh_settings(
    mode: Mode,
    listen: tuple[str, ...],
    connect: tuple[str, ...],
    *,
    scouting: bool = False,
    security: Security | None = None,
    connections_max: int = SESSIONS_MAX,
) -> dict[str, object]:
    """Return every setting of a node that matters, by its path."""
    settings: dict[str, object] = {
        "mode": mode,
        "listen/endpoints": list(listen),
        "connect/endpoints": list(connect),
        "connect/retry": RETRY,
        "scouting/delay": 0,
        "scouting/multicast/enabled": scouting,
        "scouting/gossip/enabled": False,
        "transport/link/tx/lease": LEASE_MS,
        "transport/shared_memory/enabled": False,
        "transport/unicast/max_sessions": connections_max,
        "adminspace/enabled": False,
    }
    return settings if security is None else settings | security_settings(security)


def zenoh_config(settings: dict[str, object]) -> zenoh.Config:
    """Return the configuration with these settings; LinkError where Zenoh does not take one."""
    config = zenoh.Config()
    for path, value in settings.items():
        try:
            config.insert_json5(path, json.dumps(value))
        except zenoh.ZError as error:
            raise LinkError(f"Zenoh does not take {path} = {value}: {error}") from error
    return config


def as_file(settings: dict[str, object]) -> str:
    """Return settings as a file that Zenoh's own router reads."""
    nested: dict[str, object] = {}
    for path, value in settings.items():
        *sections, name = path.split("/")
        place = nested
        for section in sections:
            place = place.setdefault(section, {})  # type: ignore[assignment]
        place[name] = value
    return json.dumps(nested, indent=2) + "\n"


def open_session(
    config: zenoh.Config,
    where: str,
    patience_s: float = 0.0,
    should_stop: Callable[[], bool] = lambda: False,
) -> zenoh.Session:
    """Return an open session. With patience, missing endpoints are tried again for that time."""
    until_s = time.monotonic() + patience_s
    while True:
        try:
            return zenoh.open(config)
        except zenoh.ZError as error:
            if time.monotonic() >= until_s or should_stop():
                kind = LinkLost if patience_s > 0.0 else LinkError
                # The error, without the place in Zenoh's own source.
                why = str(error).split(" at /")[0].strip().rstrip("!.")
                raise kind(f"Zenoh cannot use {where}: {why}") from error
        time.sleep(OPEN_AGAIN_S)


def close_session(session: zenoh.Session) -> None:
    """Close a session; a frozen peer may keep Zenoh from ending it in time, and costs no result."""
    with suppress(zenoh.ZError):
        session.close()


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
    # Only clients receive each other through a router: it does not forward messages of peers.
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
