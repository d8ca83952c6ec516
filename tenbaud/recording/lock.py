"""A lock that the recorder holds on its file, and that ends with its process.

Where the system or the file system has no such locks, a recording that grew within the last seconds
counts as in use; a recorder writes at least once a second while its flight goes on.
"""

from __future__ import annotations

import time
from pathlib import Path

try:
    import fcntl
except ImportError:  # not a system with POSIX locks
    fcntl = None  # type: ignore[assignment]

QUIET_S = 3.0


def hold(handle: int) -> bool:
    """Take the lock of an open file for as long as it stays open; False: somebody else has it.

    True also where there are no locks: recording goes on without.
    """
    return try_lock(handle) is not False


def try_lock(handle: int) -> bool | None:
    """Return whether the lock was taken; None where there are no locks."""
    if fcntl is None:
        return None
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return None
    return True


def in_use(handle: int, path: Path) -> bool:
    """Whether another process writes this open file; if none does, take the lock."""
    locked = try_lock(handle)
    if locked is not None:
        return not locked
    return _grows(path)


def _grows(path: Path) -> bool:
    before = path.stat()
    time.sleep(QUIET_S)
    after = path.stat()
    return (before.st_size, before.st_mtime_ns) != (after.st_size, after.st_mtime_ns)
