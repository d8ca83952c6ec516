"""Keys on disk: a folder for the authority, and one for each node that is copied to its machine.

    keys/authority/authority.pem   certificate of the authority
    keys/authority/authority.key   its private key; stays on the machine where nodes are added
    keys/NAME/authority.pem        what a node trusts
    keys/NAME/node.pem             who the node is
    keys/NAME/node.key             its private key

Private keys have mode 0600 and their folders 0700; a key that others may read is refused.
"""

from __future__ import annotations

import re
import stat
from contextlib import ExitStack
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from shlex import quote

from channel.errors import TenbaudError
from channel.links.security import Credentials
from tenbaud.files.whole import whole_file, whole_path, write_error, write_whole
from tenbaud.keys.authority import (
    NODE_DAYS,
    Certified,
    NodeRole,
    Pem,
    end_of,
    is_key_of,
    is_signed_by,
    issue,
    new_authority,
    read_certificate,
)

AUTHORITY = "authority"
AUTHORITY_NAME = "tenbaud authority"
WARN_DAYS = 30.0
"""Before a certificate expires by so much, every start says so."""

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,62}")
_OTHERS = stat.S_IRWXG | stat.S_IRWXO


class KeysError(TenbaudError):
    """Keys that are missing, unreadable, expired or open to others; the text gives the remedy."""


@dataclass(frozen=True, slots=True)
class NodeKeys:
    """A node's folder, read."""

    folder: Path
    certified: Certified

    @property
    def credentials(self) -> Credentials:
        """Return the three files, with absolute paths."""
        folder = self.folder.resolve()
        return Credentials(
            self.certified.name, folder / "authority.pem", folder / "node.pem", folder / "node.key"
        )


def create_authority(keys: Path) -> Path:
    """Make the authority below a folder; return its own folder."""
    folder = keys / AUTHORITY
    if folder.exists():
        raise KeysError(
            f"{folder} exists already; add nodes with `tenbaud keys add NAME`, or name another folder "
            "with --folder"
        )
    pem = new_authority(AUTHORITY_NAME)
    _make_private(keys)
    with whole_path(folder) as part:
        _make_private(part)
        write_whole(part / "authority.key", pem.private_key, 0o600)
        write_whole(part / "authority.pem", pem.certificate, 0o644)
    return folder


def add_node(
    keys: Path, name: str, role: NodeRole, hosts: tuple[str, ...], days: float = NODE_DAYS
) -> NodeKeys:
    """Make key and certificate of a node; KeysError if there is one of this name already."""
    if not _NAME.fullmatch(name) or name == AUTHORITY:
        raise KeysError(f"node name {name!r}: letters, digits, '_', '-' and '.', and not 'authority'")
    if (keys / name).exists():
        raise KeysError(f"{keys / name} exists already; `tenbaud keys renew {name}` renews it")
    if role in (NodeRole.RECEIVER, NodeRole.ROUTER) and not hosts:
        raise KeysError(
            f"a {role} is connected to: say where with --host ADDRESS, repeatable; the other end "
            "checks that the certificate names the address it connects to"
        )
    authority = read_authority(keys)
    pem = _issue(authority, name, role, hosts, days)
    with whole_path(keys / name) as part:
        _make_private(part)
        _write_node(part, authority, pem)
    return read_node(keys / name)


def renew_node(keys: Path, name: str, hosts: tuple[str, ...] = (), days: float = NODE_DAYS) -> NodeKeys:
    """Replace key and certificate of a node, with other addresses if any are given."""
    old = read_node(keys / name)
    authority = read_authority(keys)
    certified = old.certified
    pem = _issue(authority, name, certified.role, hosts or certified.hosts, days)
    _write_node(keys / name, authority, pem)
    return read_node(keys / name)


def read_node(folder: Path) -> NodeKeys:
    """Read a node's folder; KeysError if something in it is missing, foreign or open to others."""
    try:
        certificate = (folder / "node.pem").read_bytes()
        authority = (folder / "authority.pem").read_bytes()
        mode = (folder / "node.key").stat().st_mode
        key = (folder / "node.key").read_bytes()
        _check_unchanged(folder)
    except OSError as error:
        raise KeysError(
            f"{folder} is no node's key folder ({error.strerror}: {error.filename}); make one with "
            "`tenbaud keys add NAME` and copy it whole"
        ) from error
    _check_private(folder / "node.key", mode)
    try:
        certified = read_certificate(certificate)
        signed = is_signed_by(certificate, authority)
        belongs = is_key_of(key, certificate)
    except (TypeError, ValueError) as error:
        raise KeysError(f"{folder / 'node.pem'} cannot be used: {error}") from error
    if not signed:
        raise KeysError(
            f"{folder / 'node.pem'} was not signed by the authority beside it; copy the folder of one "
            "authority whole"
        )
    if not belongs:
        raise KeysError(
            f"{folder / 'node.key'} is not the key of node.pem beside it; where the authority is: "
            f"`tenbaud keys renew {certified.name}`, then copy the folder again"
        )
    return NodeKeys(folder, certified)


def usable(folder: Path, role: NodeRole) -> NodeKeys:
    """Read a node's folder for use now, in this role; KeysError when expired or for another role."""
    node = read_node(folder)
    certified = node.certified
    try:
        str(folder.resolve()).encode()
    except UnicodeEncodeError as error:
        raise KeysError(
            f"{folder.resolve()} is no text in UTF-8, and Zenoh takes no other name; move the keys"
        ) from error
    if certified.role is not role:
        raise KeysError(
            f"{folder} is the certificate of a {certified.role}, and this is a {role}; make one with "
            f"`tenbaud keys add NAME --role {role}`"
        )
    left = certified.days_left()
    if left <= 0.0:
        raise KeysError(
            f"the certificate in {folder} expired on {certified.expires:%Y-%m-%d}; where the authority "
            f"is: `tenbaud keys renew {certified.name}`, then copy the folder again"
        )
    if certified.begins > datetime.now(UTC):
        raise KeysError(
            f"the certificate in {folder} is valid from {certified.begins:%Y-%m-%d %H:%M} UTC on; is "
            "this machine's clock right?"
        )
    return node


def expiry_warning(node: NodeKeys) -> str | None:
    """Return the warning about a certificate that expires soon."""
    left = node.certified.days_left()
    if left > WARN_DAYS:
        return None
    return (
        f"the certificate in {node.folder} expires in {left:.0f} days; renew it where the authority "
        f"is: tenbaud keys renew {node.certified.name}"
    )


def read_nodes(keys: Path) -> list[NodeKeys]:
    """Return all nodes below a folder, by name."""
    found = sorted(keys.glob("*/node.pem"))
    return [read_node(path.parent) for path in found]


def _issue(authority: Pem, name: str, role: NodeRole, hosts: tuple[str, ...], days: float) -> Pem:
    try:
        return issue(authority, name, role, hosts, days)
    except ValueError as error:
        raise KeysError(f"no certificate for {name} at {', '.join(hosts)}: {error}") from error


def read_authority(keys: Path) -> Pem:
    """Return the authority below a folder, to sign with; KeysError if there is none or it expired."""
    folder = keys / AUTHORITY
    try:
        pem = Pem((folder / "authority.pem").read_bytes(), (folder / "authority.key").read_bytes())
        mode = (folder / "authority.key").stat().st_mode
    except OSError as error:
        raise KeysError(
            f"there is no authority in {folder} ({error.strerror}); `tenbaud keys init` makes one, and "
            "--folder names another place"
        ) from error
    _check_private(folder / "authority.key", mode)
    try:
        end = end_of(pem.certificate)
    except ValueError as error:
        raise KeysError(f"{folder / 'authority.pem'} cannot be used: {error}") from error
    if end <= datetime.now(UTC):
        raise KeysError(
            f"the authority in {folder} expired on {end:%Y-%m-%d}, and nothing that it signs is valid "
            "any more; make another with `tenbaud keys init --folder ELSEWHERE`, and every node anew"
        )
    return pem


def _check_private(key: Path, mode: int) -> None:
    if mode & _OTHERS:
        raise KeysError(
            f"{key} can be read by others (mode {stat.S_IMODE(mode):04o}); take that away: "
            f"chmod 600 {quote(str(key))}"
        )


def _check_unchanged(folder: Path) -> None:
    """Refuse a folder in which somebody else can put another authority."""
    for path in (folder, folder / "authority.pem", folder / "node.pem"):
        mode = path.stat().st_mode
        sticky = path == folder and mode & stat.S_ISVTX  # there everybody keeps their own files
        if mode & (stat.S_IWGRP | stat.S_IWOTH) and not sticky:
            raise KeysError(
                f"{path} can be changed by others (mode {stat.S_IMODE(mode):04o}), who could choose "
                f"whom to trust; take that away: chmod go-w {quote(str(path))}"
            )


def _write_node(folder: Path, authority: Pem, pem: Pem) -> None:
    """Write the three files of a node: all of them new, or all as they were."""
    with ExitStack() as written:
        for name, data, mode in (
            ("authority.pem", authority.certificate, 0o644),
            ("node.pem", pem.certificate, 0o644),
            ("node.key", pem.private_key, 0o600),
        ):
            stream = written.enter_context(whole_file(folder / name, mode))
            stream.write(data)
            stream.flush()


def _make_private(folder: Path) -> None:
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    except OSError as error:
        raise write_error(folder, error) from error
