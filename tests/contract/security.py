"""Keys and access for links within one test process."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

from channel.links.endpoints import free_endpoint, with_protocol
from channel.links.security import Credentials, Invited, Part, Security
from tenbaud.keys.authority import NodeRole
from tenbaud.keys.store import add_node, create_authority, read_node

SESSION = "test/security"
ROLES = {
    "rig": NodeRole.TRANSMITTER,
    "desk": NodeRole.RECEIVER,
    "hub": NodeRole.ROUTER,
    "intern": NodeRole.TRANSMITTER,
    "page": NodeRole.VIEWER,
}
_FOLDER = TemporaryDirectory(prefix="tenbaud-keys-")


@cache
def keys() -> Path:
    """Return a folder with an authority and one node of every role."""
    folder = Path(_FOLDER.name) / "keys"
    create_authority(folder)
    for name, role in ROLES.items():
        add_node(folder, name, role, ("lab.example",))
    return folder


def credentials(name: str) -> Credentials:
    return read_node(keys() / name).credentials


def security(name: str, *invited: tuple[str, Part], session: str = SESSION) -> Security:
    return Security(credentials(name), tuple(Invited(who, part, session) for who, part in invited))


def free_tls_endpoint() -> str:
    return with_protocol(free_endpoint(), "tls")
