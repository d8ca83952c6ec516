"""The folder of one run: its name, and the names of the files in it."""

from __future__ import annotations

import errno
import os
import re
import stat
import time
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any, BinaryIO

import orjson

from tenbaud.files.whole import write_error
from tenbaud.recording.errors import RecordingError

try:
    import fcntl
except ImportError:  # not a system with POSIX locks
    fcntl = None  # type: ignore[assignment]

QUIET_S = 3.0
"""Where there are no locks, a recording that grew within this time counts as in use: a recorder writes
at least once a second while its flight goes on."""


def try_lock(handle: int) -> bool | None:
    """Take the lock of an open file for as long as it stays open.

    Return whether it was taken; None where there are no locks: recording goes on without.
    """
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


DEFAULT_ROOT = Path("runs")
CONFIG_NAME = "config.toml"
TRANSMITTER_NAME = "transmitter.mcap"
RECEIVER_NAME = "receiver.mcap"
SUMMARY_NAME = "summary.json"
FIGURE_NAME = "flight.png"
SMALL_BYTES_MAX = 4 << 20
"""Of a configuration or a summary that is read."""


@dataclass(frozen=True, slots=True)
class RunFolder:
    """The paths of a run's files, whether they exist or not."""

    path: Path

    @property
    def config(self) -> Path:
        """The complete configuration the run was flown with."""
        return self.path / CONFIG_NAME

    @property
    def transmitter(self) -> Path:
        return self.path / TRANSMITTER_NAME

    @property
    def receiver(self) -> Path:
        return self.path / RECEIVER_NAME

    @property
    def summary(self) -> Path:
        return self.path / SUMMARY_NAME

    @property
    def figure(self) -> Path:
        return self.path / FIGURE_NAME

    def recordings(self) -> list[Path]:
        """The recordings that exist, the transmitter's first; RecordingError for a symbolic link."""
        return [path for path in (self.transmitter, self.receiver) if is_own_file(path)]


def is_own_file(path: Path) -> bool:
    """Whether there is such a file in a run folder; RecordingError if it is a symbolic link.

    A run folder may come from anybody, and a link in it would have this machine's files read.
    """
    if path.is_symlink():
        raise RecordingError(
            f"{path} is a symbolic link, and links within a run folder are not followed. "
            "If you know where it leads, put a copy of that file in its place."
        )
    return path.is_file()


def create_run_folder(
    root: Path | None, name: str, explicit: Path | None, now: datetime | None = None
) -> Path:
    """Make a new, empty folder for a run and return it.

    Without `explicit` it is `<root>/<local time>_<name>`, with -2, -3 ... appended if taken; root
    is `runs` if not given. An explicit folder must not exist yet. `now` is the clock, for tests.
    Raises RecordingError if the folder exists, WriteError if it cannot be made.
    """
    if explicit is not None:
        if not _make(explicit):
            raise RecordingError(
                f"The run folder {explicit} exists already and is not overwritten. "
                "Give a new folder, or none at all to have one named after date and time."
            )
        return explicit
    moment = (now or datetime.now()).strftime("%Y-%m-%dT%H-%M-%S")
    safe_name = re.sub(r"[^A-Za-z0-9._-]+", "-", name).strip("-.") or "run"
    base = root if root is not None else DEFAULT_ROOT
    return make_numbered(base / f"{moment}_{safe_name}")


def make_numbered(wished: Path) -> Path:
    """Make a folder of this name, with -2, -3 ... appended if it is taken. Raises WriteError."""
    folder = wished
    number = 1
    while not _make(folder):
        number += 1
        folder = wished.with_name(f"{wished.name}-{number}")
    return folder


def _make(folder: Path) -> bool:
    """Make the folder; False if the name is taken. Asking first would leave a gap for another."""
    try:
        folder.mkdir(parents=True)
    except OSError as error:
        if isinstance(error, FileExistsError) and folder.parent.is_dir():
            return False
        raise write_error(folder, error) from error
    return True


def find_recordings(path: Path) -> list[Path]:
    """The recordings meant by a path: those in a run folder, or the file itself.

    Raises RecordingError if there are none.
    """
    if not path.is_dir():
        if path.is_file():
            return [path]
        raise RecordingError(
            f"{path} does not exist. Give the folder of a run, such as those in `runs/`, "
            "or a recording in it."
        )
    found = RunFolder(path).recordings()
    if not found:
        raise RecordingError(
            f"The folder {path} holds neither {TRANSMITTER_NAME} nor {RECEIVER_NAME}. "
            "Give the folder of one run, not the folder that holds the runs."
        )
    return found


def open_plain(path: Path) -> BinaryIO:
    """Open a file for reading; OSError for what is missing or no plain file."""
    # Without O_NONBLOCK a pipe laid in its place would be waited for.
    handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0))
    if not stat.S_ISREG(os.fstat(handle).st_mode):
        os.close(handle)
        raise OSError(errno.EINVAL, "it is not a file", str(path))
    return open(handle, "rb")


def read_small(path: Path) -> str:
    """Return the text of a small file of a run folder.

    Raises OSError for what is missing, no plain file or too large, ValueError for what is no text, and
    RecordingError for a symbolic link.
    """
    is_own_file(path)
    with open_plain(path) as stream:
        data = stream.read(SMALL_BYTES_MAX + 1)
    if len(data) > SMALL_BYTES_MAX:
        raise OSError(errno.EFBIG, f"it has more than {SMALL_BYTES_MAX} bytes", str(path))
    return data.decode()


def read_summary(path: Path) -> dict[str, Any]:
    """Return the figures in a `summary.json`; empty without it, and where it is of another form."""
    try:
        summary = orjson.loads(read_small(path))
    except (OSError, ValueError):
        return {}
    from tenbaud.recording.summary_form import is_summary

    return summary if is_summary(summary) else {}


def open_new_recording(path: Path) -> BinaryIO:
    """Open a file for writing, and hold its lock; RecordingError if it holds data or cannot be made.

    A link is not followed: what it leads to is nobody's recording.
    """
    flags = os.O_WRONLY | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0)
    try:
        stream = os.fdopen(os.open(path, flags, 0o666), "wb")
    except OSError as error:
        raise write_error(path, error) from error
    if try_lock(stream.fileno()) is False or os.fstat(stream.fileno()).st_size > 0:
        stream.close()
        raise RecordingError(
            f"The recording {path} exists already and is not overwritten. "
            "Choose another folder or move the file away."
        )
    return stream
