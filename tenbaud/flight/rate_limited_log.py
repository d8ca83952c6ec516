"""A rate limiter for log lines that other machines can cause.

The first lines are written at once, later ones at a limited rate. The next line gives the number of
omitted ones. So an intruder can neither fill a disk nor delay the loop that logs.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

LINES_AT_ONCE = 20
PERIOD_S = 10.0
"""After the first `LINES_AT_ONCE` lines, one line in this time."""
CHARACTERS_MAX = 2000
"""Of a line, whose text may come from outside."""


class RateLimitedLog:
    """Passes lines to `write`, from any thread; `clock_s` is a monotonic clock."""

    def __init__(
        self, write: Callable[[str], None], clock_s: Callable[[], float] = time.monotonic
    ) -> None:
        self._write = write
        self._clock_s = clock_s
        self._lock = threading.Lock()
        self._allowance = float(LINES_AT_ONCE)
        self._seen_s = clock_s()
        self._omitted = 0

    def __call__(self, text: str) -> None:
        """Write a line, or count it."""
        with self._lock:
            now_s = self._clock_s()
            earned = (now_s - self._seen_s) / PERIOD_S
            self._seen_s = now_s
            self._allowance = min(float(LINES_AT_ONCE), self._allowance + earned)
            if self._allowance < 1.0:
                self._omitted += 1
                return
            self._allowance -= 1.0
            left_out, self._omitted = self._omitted, 0
        self._write(_plain(text) + _left_out(left_out))

    def finish(self) -> None:
        """Write how many lines were left out since the last one, if any were."""
        with self._lock:
            left_out, self._omitted = self._omitted, 0
        if left_out:
            self._write(_left_out(left_out).strip())


def _left_out(count: int) -> str:
    return f" ({count} more such line(s) left out)" if count else ""


def _plain(text: str) -> str:
    """Return a text without control characters, for the terminal."""
    shown = text[:CHARACTERS_MAX] + (" ..." if len(text) > CHARACTERS_MAX else "")
    return "".join(one if one.isprintable() or one == "\n" else "?" for one in shown)
