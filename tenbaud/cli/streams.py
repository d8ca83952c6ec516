"""The standard streams: closed, full or lost ones do not end a flight, and are reported.

A stream that was closed before the start is opened on the null device: otherwise the next file opened
would get its number, and the output of libraries. Output that cannot be written is remembered and
reported when the command ends; failures of standard error cannot be reported anywhere. Bytes of file
names that are not text are written as they are; characters outside the terminal's encoding are
written with a backslash.
"""

from __future__ import annotations

import codecs
import io
import os
import sys
from collections.abc import Callable
from contextlib import suppress
from typing import TextIO

BYTES_AS_THEY_ARE = "tenbaud-bytes-as-they-are"
_FIRST, _LAST = "\udc80", "\udcff"
"""Python's replacements for bytes that are not text."""


class KeptStream(io.TextIOWrapper):
    """A text stream that keeps its first error instead of raising it."""

    error: OSError | None = None
    before_write: Callable[[], None] = staticmethod(lambda: None)

    def write(self, text: str) -> int:
        self.before_write()
        try:
            return super().write(text)
        except OSError as error:
            self.error = self.error or error
            return len(text)

    def flush(self) -> None:
        try:
            super().flush()
        except OSError as error:
            self.error = self.error or error


def prepare_streams() -> None:
    """Make the process' three streams safe to use; to be called before any file is opened."""
    codecs.register_error(BYTES_AS_THEY_ARE, _bytes_as_they_are)
    for number in (0, 1, 2):
        try:
            os.fstat(number)
        except OSError:
            # The lowest number that is free is this one.
            os.open(os.devnull, os.O_RDWR)
    sys.stdout = _kept(sys.stdout, 1)
    sys.stderr = _kept(sys.stderr, 2)


def lost_output() -> OSError | None:
    """Return why something could not be written to standard output, None if all was."""
    sys.stdout.flush()
    return getattr(sys.stdout, "error", None)


def leave(code: int) -> None:
    """End the process with this code, even if its streams cannot be written."""
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError):
            stream.flush()
        if getattr(stream, "error", None) is not None:
            # The interpreter would try again at exit, and end with its own code.
            with suppress(OSError, ValueError):
                os.dup2(os.open(os.devnull, os.O_RDWR), stream.fileno())
    # If an interrupt passed an `exec` of text, as in the import of a dataclass, CPython ends a process
    # by SIGINT, whatever its code. It forgets that at the next `exec`.
    exec("")
    sys.exit(code)


def _kept(stream: TextIO | None, number: int) -> TextIO:
    encoding = "utf-8" if stream is None else stream.encoding
    own = io.FileIO(number, "wb", closefd=False)
    return KeptStream(
        io.BufferedWriter(own),
        encoding=encoding,
        errors=BYTES_AS_THEY_ARE,
        line_buffering=number == 2 or own.isatty(),
    )


def _bytes_as_they_are(error: UnicodeError) -> tuple[bytes, int]:
    if not isinstance(error, UnicodeEncodeError):
        raise error
    part = error.object[error.start : error.end]
    written = b"".join(
        bytes([ord(one) - 0xDC00])
        if _FIRST <= one <= _LAST
        else one.encode("ascii", "backslashreplace")
        for one in part
    )
    return written, error.end
