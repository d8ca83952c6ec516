"""Lines on a terminal or in a log that somebody outside can cause: told sparingly.

The first are told at once, then one every so often; what is left out is counted, and the count is
told with the next one. So an intruder can neither fill a disk nor hold up the loop that tells.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

LINES_AT_ONCE = 20
PERIOD_S = 10.0
"""After so many lines at once, one line in this time."""
CHARACTERS_MAX = 2000
"""Of a line, whose text may come from outside."""


class RateLimitedLog:
    """Hands lines on to `tell`, from any thread; `clock_s` gives a time that does not run back."""

    def __init__(
        self, tell: Callable[[str], None], clock_s: Callable[[], float] = time.monotonic
    ) -> None:
        self._tell = tell
        self._clock_s = clock_s
        self._lock = threading.Lock()
        self._allowance = float(LINES_AT_ONCE)
        self._seen_s = clock_s()
        self._omitted = 0

    def __call__(self, text: str) -> None:
        """Tell a line, or count it."""
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
        self._tell(_plain(text) + _left_out(left_out))

    def finish(self) -> None:
        """Tell how many lines were left out since the last one, if any were."""
        with self._lock:
            left_out, self._omitted = self._omitted, 0
        if left_out:
            self._tell(_left_out(left_out).strip())


def _left_out(count: int) -> str:
    return f" ({count} more such line(s) left out)" if count else ""


def _plain(text: str) -> str:
    """Return what a terminal shows as text, whatever somebody wrote into it."""
    shown = text[:CHARACTERS_MAX] + (" ..." if len(text) > CHARACTERS_MAX else "")
    return "".join(one if one.isprintable() or one == "\n" else "?" for one in shown)
