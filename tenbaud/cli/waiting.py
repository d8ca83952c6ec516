"""A line on the terminal while a command prints nothing: `tenbaud audit: working, 3 s`."""

from __future__ import annotations

import os
import sys
import threading
import time
from contextlib import suppress
from typing import Self

AFTER_S = 0.3
PERIOD_S = 0.5
COMPLETES = "_TENBAUD_COMPLETE"
"""Set by a shell that asks for completions."""


class Waiting:
    """Begins after `AFTER_S`, and disappears with the command's first output or with `end`."""

    def __init__(self, what: str, number: int = 2, doing: str = "working") -> None:
        self._what = f"{what}: {doing}"
        self._number = number
        self._shown = False
        self._lock = threading.Lock()
        self._over = threading.Event()
        if number >= 0 and os.isatty(number) and os.environ.get("TERM") != "dumb":
            threading.Thread(target=self._run, name="waiting", daemon=True).start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.end()

    def end(self) -> None:
        """Clear the line, for good."""
        if self._over.is_set():
            return
        with self._lock:
            self._over.set()
            if self._shown:
                os.write(self._number, b"\r\x1b[K")

    def _run(self) -> None:
        started = time.monotonic()
        wait_s = AFTER_S
        while not self._over.wait(wait_s):
            wait_s = PERIOD_S
            text = f"\r{self._what}, {time.monotonic() - started:.0f} s"
            with self._lock:
                if not self._over.is_set():
                    self._shown = True
                    with suppress(OSError):  # the terminal is gone
                        os.write(self._number, text.encode(errors="replace"))


def begin(arguments: list[str]) -> Waiting:
    """Return the line of a command, which its streams end."""
    if COMPLETES in os.environ:
        return Waiting("", -1)
    words = [one for one in arguments[:1] if not one.startswith("-")]
    waiting = Waiting(" ".join(["tenbaud", *words]))
    for stream in (sys.stdout, sys.stderr):
        stream.before_write = waiting.end  # type: ignore[union-attr]
    return waiting
