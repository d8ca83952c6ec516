"""Addresses of the two ends, and which of them stay on this machine."""

from __future__ import annotations

import contextlib
import ipaddress
import socket
import sys
from collections import deque

from channel.errors import LinkError

DEFAULT_PORT = 7447
DEFAULT_ENDPOINT = f"tcp/127.0.0.1:{DEFAULT_PORT}"

_held: deque[socket.socket] = deque(maxlen=256)


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


def check_endpoints(
    endpoints: tuple[str, ...], insecure: bool, secured: bool = False, scouting: bool = False
) -> None:
    """Refuse an endpoint that leaves this machine without protection, unless it is allowed.

    `secured`: the end has a certificate, so that every endpoint has to be TLS. `scouting` looks for the
    other end by multicast, which leaves this machine too.
    """
    for endpoint in endpoints:
        protocol, slash, address = endpoint.partition("/")
        if not slash or ":" not in address:
            raise LinkError(
                f"{endpoint!r} is not an endpoint; write PROTOCOL/HOST:PORT, such as {DEFAULT_ENDPOINT}"
            )
        if secured and protocol != "tls":
            raise LinkError(
                f"{endpoint}: with --keys everything goes over TLS; write tls/{address}, at both ends"
            )
        if not secured and protocol in ("tls", "quic"):
            raise LinkError(
                f"{endpoint} needs this node's certificate; add --keys FOLDER and --peer NAME "
                "(`tenbaud keys init` and `tenbaud keys add NAME` make them)"
            )
        if not insecure and not secured and not is_loopback(endpoint):
            raise LinkError(_open_to_all(endpoint))
    if scouting and not secured and not insecure:
        raise LinkError(_open_to_all("--scout"))


def with_protocol(endpoint: str, protocol: str) -> str:
    """Return the endpoint over another protocol."""
    return f"{protocol}/{endpoint.partition('/')[2]}"


def _open_to_all(what: str) -> str:
    return (
        f"{what} leaves this machine, and the link would be open to anyone who reaches it: no "
        "encryption, no check of who commands the motors. Make keys once, on one machine:\n"
        "  tenbaud keys init\n"
        "and a certificate for each of the two (`tenbaud keys add --help`), then give --keys and "
        "--peer with tls/HOST:PORT. On a network that you trust with open motors, add --insecure; "
        "otherwise keep to 127.0.0.1"
    )


def loopback_host() -> str:
    """Return this machine's own address: 127.0.0.1, or ::1 where there is no IPv4."""
    for family, host in ((socket.AF_INET, "127.0.0.1"), (socket.AF_INET6, "::1")):
        with contextlib.suppress(OSError), socket.socket(family) as probe:
            probe.bind((host, 0))
            return host
    raise LinkError("this machine has no loopback address, 127.0.0.1 or ::1; is its interface lo up?")


def default_endpoint() -> str:
    """Return where both ends meet on this machine if nothing else is said."""
    return _on_loopback(DEFAULT_PORT)


def free_endpoint() -> str:
    """Return a loopback TCP endpoint whose port the system gives to nobody else for now.

    On Linux this process holds the port without listening: a server that sets SO_REUSEADDR may listen
    there. Other systems refuse the server a port that is held, so there it was free a moment ago.
    """
    host = loopback_host()
    holder = socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET)
    holder.bind((host, 0))
    holder.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    port = holder.getsockname()[1]
    if sys.platform == "linux":
        _held.append(holder)
    else:
        holder.close()
    return _on_loopback(port)


def _on_loopback(port: int) -> str:
    host = loopback_host()
    return f"tcp/[{host}]:{port}" if ":" in host else f"tcp/{host}:{port}"
