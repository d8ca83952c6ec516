"""The addresses of telemetry.

Without further word an end listens on a socket file in a folder that only its user may enter: nothing
on this machine's network, no port that two flights could want, and a viewer finds every flight of its
user there by itself.
"""

from __future__ import annotations

import contextlib
import os
import secrets
import socket
import stat
import tempfile
from collections.abc import Sequence
from pathlib import Path

from channel.errors import LinkError
from channel.links.base import Role
from channel.links.endpoints import check_endpoints, is_loopback
from tenbaud.recording.folder import try_lock

SOCKET = "unixsock-stream/"
PATH_BYTES_MAX = 100
"""The operating system takes 108 with the ending that Zenoh's lock file has."""


def endpoint_for(
    requested: str,
    role: Role,
    addresses: Sequence[str] = (),
    insecure: bool = False,
    secured: bool = False,
) -> str | None:
    """Return where an end shall listen for viewers; None: nowhere.

    `requested` is "" (default: on, but off beside an insecure link that leaves this machine), "on",
    "off" or a Zenoh endpoint. `secured`: there is a certificate for it. Raises LinkError.
    """
    if requested == "off":
        return None
    if requested in ("", "on"):
        exposed = insecure and not all(is_loopback(address) for address in addresses)
        if not requested and (exposed or not hasattr(socket, "AF_UNIX")):
            return None
        # By chance, since processes of two containers that share the folder may have one number.
        path = private_folder() / f"{role}-{secrets.token_hex(4)}.sock"
        clear_stale()
        return f"{SOCKET}{path}"
    protocol = requested.partition("/")[0]
    if not is_loopback(requested) or protocol == "tls":
        check_endpoints((requested,), insecure, secured)
    return requested


def private_folder() -> Path:
    """Return the folder of this user's socket files, made if it is not there. Raises LinkError."""
    if not hasattr(socket, "AF_UNIX"):
        raise LinkError("no socket files on this system; give --telemetry tcp/127.0.0.1:7448")
    base = Path(os.environ.get("XDG_RUNTIME_DIR") or tempfile.gettempdir())
    folder = base / f"tenbaud-{os.getuid()}"
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        found = folder.lstat()
    except OSError as error:
        raise LinkError(f"no folder for telemetry at {folder}: {error.strerror}") from error
    if not stat.S_ISDIR(found.st_mode) or found.st_uid != os.getuid() or found.st_mode & 0o077:
        raise LinkError(
            f"{folder} is open to others than its user, and who can enter it could steer a flight; "
            "remove it, or fly with --telemetry off"
        )
    if len(os.fsencode(folder)) > PATH_BYTES_MAX - len("/transmitter-00000000.sock"):
        raise LinkError(
            f"{folder} is too long a path for sockets; set XDG_RUNTIME_DIR to a shorter one"
        )
    return folder


def found_endpoints() -> list[str]:
    """Return the endpoints of this user's flights, the newest last."""
    clear_stale()
    with contextlib.suppress(OSError):
        files = [(path.stat().st_mtime, path) for path in private_folder().glob("*.sock")]
        return [f"{SOCKET}{path}" for _, path in sorted(files)]
    return []


def clear_stale() -> None:
    """Remove the socket files that nobody listens at any more."""
    for path in private_folder().glob("*.sock"):
        lock = path.with_name(f"{path.name}.lock")
        if not _is_held(lock):
            for file in (path, lock):
                file.unlink(missing_ok=True)


def _is_held(lock: Path) -> bool:
    """Return whether somebody holds the lock that Zenoh keeps for as long as it listens.

    It is seen in every container that has the folder, where a process number would be another's.
    """
    try:
        with lock.open("rb") as file:
            return try_lock(file.fileno()) is not True
    except FileNotFoundError:
        return False
    except OSError:
        return True
