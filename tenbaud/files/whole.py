"""Writes every file of a command completely or not at all.

A file is written beside its place under a temporary name, flushed to the disk and renamed. A process
that is stopped, killed or out of space leaves the old file or none, and never half of the new one.
Recordings are the exception: they are read as far as they go (`tenbaud/recording/writer.py`).
"""

from __future__ import annotations

import errno
import os
import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from channel.errors import TenbaudError

NAME_CHARACTERS = 40
"""Of the file's own name in the temporary one, which may be no longer than the system allows."""

_ADVICE = {
    errno.ENOSPC: "Free some space, or choose another place",
    errno.EDQUOT: "Free some space, or choose another place",
    errno.EROFS: "The file system is read-only: choose another place",
    errno.EACCES: "Choose a place that this user may write to",
    errno.EPERM: "Choose a place that this user may write to",
    errno.ENOTDIR: "A file is in the place of the folder: choose another place",
    errno.ENAMETOOLONG: "Choose a shorter name",
    errno.ELOOP: "It is a symbolic link, and links are not followed: remove it or choose another place",
}


class WriteError(TenbaudError):
    """A file or folder could not be written; the text names it, the reason and the remedy."""


def write_error(path: Path | str, error: OSError) -> WriteError:
    """Return the error to raise where the system refused to write `path`."""
    reason = os.strerror(error.errno) if error.errno else str(error)
    advice = _ADVICE.get(error.errno or 0)
    return WriteError(f"{path} cannot be written: {reason}." + (f" {advice}." if advice else ""))


@contextmanager
def whole_path(path: Path) -> Iterator[Path]:
    """Yield a temporary path for a new file or folder, which gets its name when the `with` ends well.

    An existing file, link or folder of that name is replaced; a link is never followed. Raises
    WriteError for every OSError within the `with`.
    """
    part = _beside(path)
    try:
        yield part
        _flush(part)
        if part.is_dir() and path.is_dir() and not path.is_symlink():
            shutil.rmtree(path)
        part.replace(path)
        _flush_entry(path.parent)
    except OSError as error:
        raise write_error(path, error) from error
    except WriteError as error:
        # Of a file within the temporary folder: its name would say nothing.
        if isinstance(error.__cause__, OSError):
            raise write_error(path, error.__cause__) from error.__cause__
        raise
    finally:
        with suppress(OSError):
            remove(part)


@contextmanager
def whole_file(path: Path, mode: int | None = None) -> Iterator[BinaryIO]:
    """Yield a stream for a new file, which gets its name when the `with` ends well.

    With `mode`, nobody whom it excludes can read the file at any moment. What is no file (/dev/null, a
    pipe) is written to as it is. Raises WriteError for every OSError within the `with`.
    """
    if path.exists() and not path.is_file() and not path.is_dir():
        try:
            with path.open("wb") as stream:
                yield stream
        except OSError as error:
            raise write_error(path, error) from error
        return
    with whole_path(path) as part:
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL
        with os.fdopen(os.open(part, flags, 0o666 if mode is None else mode), "wb") as stream:
            yield stream


def write_whole(path: Path, content: bytes | str, mode: int | None = None) -> None:
    """Write a file; WriteError where that is not possible. Text is UTF-8.

    Names that are no UTF-8 keep their bytes.
    """
    data = content.encode("utf-8", "surrogateescape") if isinstance(content, str) else content
    with whole_file(path, mode) as stream:
        stream.write(data)


def check_room(path: Path) -> None:
    """Raise WriteError where no file can be made beside `path`, for before a long computation."""
    part = _beside(path)
    try:
        part.touch()
        remove(part)
    except OSError as error:
        raise write_error(path, error) from error


def make_folder(path: Path) -> Path:
    """Make a folder and those above it, if they are not there; return it. Raises WriteError."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        if isinstance(error, FileExistsError):
            error = NotADirectoryError(errno.ENOTDIR, os.strerror(errno.ENOTDIR))
        raise write_error(path, error) from error
    return path


def remove(path: Path) -> None:
    """Remove a file or a folder, if it is there."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


def _beside(path: Path) -> Path:
    return path.with_name(f".{path.name[:NAME_CHARACTERS]}.{secrets.token_hex(4)}.part")


def _flush(part: Path) -> None:
    """Have the disk take what was written: some file systems find out here that there is no room."""
    for path in (part, *part.rglob("*")) if part.is_dir() else (part,):
        _flush_entry(path)


def _flush_entry(path: Path) -> None:
    if os.name != "posix" and path.is_dir():
        return  # Windows opens no folders
    # Windows flushes only what is open for writing.
    number = os.open(path, os.O_RDONLY if os.name == "posix" else os.O_RDWR)
    try:
        os.fsync(number)
    except OSError as error:
        # Folders of some file systems cannot be flushed.
        if error.errno not in (errno.EINVAL, errno.EBADF, errno.ENOTSUP):
            raise
    finally:
        os.close(number)
