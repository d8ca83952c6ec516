"""Shows the status of a running flight from a separate thread, which only reads.

A terminal gets a small view that is drawn in place (`screen.py`); anything else, a file or a pipe, one
plain line every two seconds. With `lines` each status is a line of JSON on standard error, for the
command that started this process.
"""

from __future__ import annotations

import json
import sys
import threading
import time
from collections.abc import Callable
from contextlib import nullcontext
from typing import TYPE_CHECKING, Self

from tenbaud.flight.status import Status, StatusMode, status_line

if TYPE_CHECKING:
    from rich.live import Live

    from tenbaud.flight.screen import Screen

PERIOD_S = 0.2
PLAIN_PERIOD_S = 2.0


class StatusDisplay:
    """Within a `with`, shows statuses to a person: drawn in place, or as plain lines."""

    def __init__(self) -> None:
        from rich.console import Console

        from tenbaud.flight.screen import Screen, unicode_fits

        console = Console(stderr=True)
        self._live: Live | None = None
        self._shown_s = 0.0
        self._screen: Screen = Screen(unicode_fits(console))
        if console.is_terminal and not console.is_dumb_terminal:
            from rich.live import Live

            self._live = Live(self._screen, console=console, transient=True, auto_refresh=False)

    def __enter__(self) -> Self:
        if self._live is not None:
            self._live.start(refresh=True)
        self._shown_s = time.monotonic()
        return self

    def __exit__(self, *_: object) -> None:
        if self._live is not None:
            self._live.stop()

    def show(self, status: Status) -> None:
        """Take a status; the display is updated at its own rate."""
        now_s = time.monotonic()
        if self._live is not None:
            self._screen.update(status)
            if now_s - self._shown_s >= PERIOD_S / 2.0:
                self._shown_s = now_s
                self._live.refresh()
        elif now_s - self._shown_s >= PLAIN_PERIOD_S:
            self._shown_s = now_s
            sys.stderr.write(f"{status_line(status)}\n")
            sys.stderr.flush()


class StatusReporter:
    """Within a `with`, shows what `look` returns, five times a second."""

    def __init__(self, look: Callable[[], Status], mode: StatusMode) -> None:
        self._look = look
        self._mode = mode
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="status", daemon=True)

    def __enter__(self) -> Self:
        if self._mode != "none":
            self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        if self._mode != "none":
            self._thread.join()

    def _run(self) -> None:
        with StatusDisplay() if self._mode == "auto" else nullcontext() as display:
            while not self._stop.wait(PERIOD_S):
                if display is not None:
                    display.show(self._look())
                    continue
                sys.stderr.write(json.dumps(self._look()) + "\n")
                sys.stderr.flush()
