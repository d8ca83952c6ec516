"""One thread that writes for many recorders, so that a hundred of them do not wake at once.

The threads of a Python process take turns: with one each, the loop would wait for all that have
something to write. This one attends to a recorder at a time and pauses in between.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from typing import Protocol

ROUND_PERIOD_S = 0.1
PAUSE_S = 0.0005
"""After each recorder: lets a loop that waits run at once."""


class Attended(Protocol):
    """A recorder, as this thread sees it."""

    def attend(self) -> bool:
        """Write what is queued; return False once it has finished."""


class SharedWriter:
    """Attends to its recorders, ten times a second, until each has finished."""

    def __init__(self) -> None:
        self._new: deque[Attended] = deque()
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, name="record all", daemon=True)
        self._thread.start()

    def add(self, recorder: Attended) -> None:
        """Write for this recorder from now on."""
        self._new.append(recorder)

    def close(self) -> None:
        """End the thread; the recorders must have been closed."""
        self._closing.set()
        self._thread.join()

    def _run(self) -> None:
        attended: list[Attended] = []
        while not self._closing.is_set():
            started_s = time.monotonic()
            while self._new:
                attended.append(self._new.popleft())
            staying = []
            for recorder in attended:
                if recorder.attend():
                    staying.append(recorder)
                time.sleep(PAUSE_S)
            attended = staying
            self._closing.wait(max(0.0, started_s + ROUND_PERIOD_S - time.monotonic()))
