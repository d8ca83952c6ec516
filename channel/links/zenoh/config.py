"""Zenoh's settings, every one that matters given: its defaults bind all interfaces and look around."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from typing import Literal

import zenoh

from channel.errors import LinkError, LinkLost
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
    """Return an open session. With patience, whatever is not there yet is tried again so long."""
    until_s = time.monotonic() + patience_s
    while True:
        try:
            return zenoh.open(config)
        except zenoh.ZError as error:
            if time.monotonic() >= until_s or should_stop():
                kind = LinkLost if patience_s > 0.0 else LinkError
                raise kind(f"Zenoh cannot use {where}: {_first_line(error)}") from error
        time.sleep(OPEN_AGAIN_S)


def _first_line(error: zenoh.ZError) -> str:
    """Return what went wrong, without the place in Zenoh's own source."""
    return str(error).split(" at /")[0].strip().rstrip("!.")
