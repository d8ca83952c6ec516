"""A pseudo-terminal with a separate name, in place of a serial port."""

from __future__ import annotations

import contextlib
import errno
import os
from pathlib import Path


class PseudoTerminal:
    """Made anew at every plugging in; `link`, if given, is a symbolic link to the one of the moment."""

    def __init__(self, link: Path | None = None) -> None:
        self._link = link
        self._other = -1
        self.handle = -1
        """this side of it, non-blocking; -1 while it is unplugged"""
        self.address = "" if link is None else str(link)
        """the name that the other side opens"""

    def plug(self) -> None:
        """Make it; OSError, with the name of the link, where that cannot be made."""
        if os.name != "posix":
            raise OSError(errno.ENOTSUP, "this system has no pseudo-terminals: give tcp:HOST:PORT")
        import tty

        self.handle, self._other = os.openpty()
        # The other side is held open here, so that reads do not fail while nobody else has it.
        tty.setraw(self._other)
        os.set_blocking(self.handle, False)
        path = os.ttyname(self._other)
        if self._link is None:
            self.address = path
            return
        try:
            if self._link.is_symlink():
                self._link.unlink()
            self._link.symlink_to(path)
        except OSError as error:
            self.unplug()
            # Of the two names it would give the wrong one.
            raise OSError(error.errno, error.strerror, str(self._link)) from error

    def unplug(self) -> None:
        """Let it vanish: a process that has it open gets an error, and its name is gone."""
        for handle in (self.handle, self._other):
            if handle >= 0:
                os.close(handle)
        self.handle = self._other = -1
        if self._link is not None and self._link.is_symlink():
            with contextlib.suppress(OSError):
                self._link.unlink()
