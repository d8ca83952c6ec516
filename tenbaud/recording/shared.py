"""One thread that writes for many recorders, so that a hundred of them do not wake at once.

The threads of a Python process take turns: with one each, the loop would wait for all that have
something to write. This one attends to a recorder at a time and pauses in between.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable

ROUND_PERIOD_S = 0.1
PAUSE_S = 0.0005
"""After each recorder: lets a loop that waits run at once."""


class SharedWriter:
    """Attends to its recorders, ten times a second, until each has finished."""

    def __init__(self) -> None:
        self._new: deque[Callable[[], bool]] = deque()
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, name="record all", daemon=True)
        self._thread.start()

    def add(self, attend: Callable[[], bool]) -> None:
        """Call this from now on, until it returns False."""
        self._new.append(attend)

    def close(self) -> None:
        """End the thread; the recorders must have been closed."""
        self._closing.set()
        self._thread.join()

    def _run(self) -> None:
        attended: list[Callable[[], bool]] = []
        while not self._closing.is_set():
            started_s = time.monotonic()
            while self._new:
                attended.append(self._new.popleft())
            staying = []
            for attend in attended:
                if attend():
                    staying.append(attend)
                time.sleep(PAUSE_S)
            attended = staying
            self._closing.wait(max(0.0, started_s + ROUND_PERIOD_S - time.monotonic()))
