"""Access to the page: two secrets, one with control and one view-only.

A secret is drawn for each run of the server and printed as part of an address. The browser that
opens this address gets a cookie with the secret, for a separate random path. Cookies ignore ports: a
browser sends them to every server of the same host name, another user's included. It sends this one
only below a path that nobody else can name.
"""

from __future__ import annotations

import secrets
import socket
from collections.abc import Mapping
from dataclasses import dataclass, field
from ipaddress import ip_address
from urllib.parse import urlsplit

COOKIE = "tenbaud"
KEY_BYTES = 16
PATH_BYTES = 8


@dataclass(frozen=True, slots=True)
class Grant:
    """The rights of the holder of one secret."""

    steers: bool
    key: str = field(default_factory=lambda: secrets.token_hex(KEY_BYTES), repr=False)
    path: str = field(default_factory=lambda: "/" + secrets.token_hex(PATH_BYTES))
    """begins everything that is served to this holder"""

    def accepts(self, key: str) -> bool:
        """Return whether this is the secret; takes as long for a nearly right one."""
        return secrets.compare_digest(key.encode(), self.key.encode())

    def address(self, url: str) -> str:
        """Return the address to print: it holds the secret."""
        return f"{url}/?key={self.key}"

    @property
    def cookie(self) -> str:
        """Return the header that hands the secret to a browser; no script can read it there."""
        return f"{COOKIE}={self.key}; Path={self.path}/; HttpOnly; SameSite=Strict"


@dataclass(frozen=True, slots=True)
class Access:
    """The secrets of one server, and the host names that it answers to; None: any IP address."""

    grants: tuple[Grant, ...]
    names: frozenset[str]
    any_address: bool = False

    def holder_of(self, key: str) -> Grant | None:
        """Return what a secret allows, None when it is none of these."""
        found = [grant for grant in self.grants if grant.accepts(key)]
        return found[0] if found else None

    def below(self, path: str) -> Grant | None:
        return next((one for one in self.grants if path.startswith(f"{one.path}/")), None)

    def answers_to(self, host: str) -> bool:
        """Return whether a `Host` header names this server.

        A page of another name that was made to resolve to this machine (DNS rebinding) does not.
        The port is free: a tunnel may have another at its other end.
        """
        try:
            name = urlsplit(f"//{host}").hostname
        except ValueError:
            return False
        return name is not None and (name in self.names or (self.any_address and _is_address(name)))


def draw_access(host: str, is_local: bool, *, view_only: bool) -> Access:
    """Draw the secrets for a server at this host; `view_only`: none that steers."""
    grants = (Grant(steers=False),) if view_only else (Grant(steers=True), Grant(steers=False))
    names = {"127.0.0.1", "localhost", host.lower()}
    if not is_local:
        own = socket.gethostname().lower()
        names |= {own, f"{own}.local", socket.getfqdn().lower()}
    return Access(grants, frozenset(names), any_address=not is_local)


def is_same_origin(headers: Mapping[str, str]) -> bool:
    """Return whether a browser says that it asks from this very page.

    `headers` have lower-case names. Browsers send `Sec-Fetch-Site` also with requests that have no
    `Origin`. A person's own step to the page as a whole may come from anywhere.
    """
    origin = headers.get("origin")
    if origin is not None:
        return urlsplit(origin).netloc == headers.get("host")
    site = headers.get("sec-fetch-site", "none")
    steps_there = headers.get("sec-fetch-mode") == "navigate"
    return site in ("same-origin", "none") or (
        steps_there and headers.get("sec-fetch-dest") == "document"
    )


def _is_address(name: str) -> bool:
    try:
        ip_address(name)
    except ValueError:
        return False
    return True
