"""Addresses of the two ends, and which of them stay on this machine."""

from __future__ import annotations

import ipaddress
import socket

from channel.errors import LinkError

DEFAULT_ENDPOINT = "tcp/127.0.0.1:7447"


def is_loopback(endpoint: str) -> bool:
    """Return whether a Zenoh endpoint such as `tcp/127.0.0.1:7447` stays on this machine."""
    protocol, _, address = endpoint.partition("/")
    if protocol.startswith("unix"):
        return True
    host = address.partition("#")[0].partition("?")[0].rpartition(":")[0].strip("[]")
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def check_endpoints(endpoints: tuple[str, ...], insecure: bool) -> None:
    """Refuse an endpoint that leaves this machine without protection, unless told to allow it."""
    for endpoint in endpoints:
        if "/" not in endpoint or ":" not in endpoint.partition("/")[2]:
            raise LinkError(
                f"{endpoint!r} is no endpoint; write PROTOCOL/HOST:PORT, such as {DEFAULT_ENDPOINT}"
            )
        if not insecure and not is_loopback(endpoint):
            raise LinkError(
                f"{endpoint} leaves this machine, and the link would be open to anyone who reaches "
                "it: no encryption, no check of who commands the motors. On a network that you "
                "trust with that, add --insecure; otherwise keep to 127.0.0.1"
            )


def free_endpoint() -> str:
    """Return a loopback TCP endpoint with a port that was free a moment ago."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{probe.getsockname()[1]}"
