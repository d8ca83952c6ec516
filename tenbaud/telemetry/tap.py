"""A recorder that also keeps the newest rows for telemetry, in a bounded queue.

Everything worth telling passes through the recorder already. The loop appends one reference to a
deque and goes on; when nobody empties it in time the oldest rows fall out and are counted. While nobody
watches, rows go straight to the recorder.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence

from channel.protocol.recording import RecordChannel, Recorder

ROWS_MAX = 8192
TOPICS = frozenset(("tick", "estimate", "sample", "event", "hypotheses"))


class Tap:
    """A `Recorder` in front of another; `rows` is emptied by one other thread."""

    def __init__(self, recorder: Recorder) -> None:
        self.rows: deque[tuple[str, Sequence[object]]] = deque(maxlen=ROWS_MAX)
        self.dropped = 0
        self._write = recorder.write
        self.write: Callable[[RecordChannel, int, Sequence[object]], None] = self._write_and_keep

    def watch(self, watched: bool) -> None:
        """Keep rows from now on, or no more. Called by the thread that takes them."""
        self.write = self._write_and_keep if watched else self._write
        if not watched:
            self.rows.clear()

    def _write_and_keep(self, channel: RecordChannel, time_ns: int, row: Sequence[object]) -> None:
        """Pass one row on, and keep it for the telemetry."""
        topic = channel.topic
        if topic in TOPICS:
            if len(self.rows) == ROWS_MAX:
                self.dropped += 1
            self.rows.append((topic, row))
        self._write(channel, time_ns, row)

    def take(self) -> list[tuple[str, Sequence[object]]]:
        """Return the rows kept since the last call, oldest first."""
        rows = self.rows
        # The loop may append meanwhile: what comes after this count waits for the next call.
        return [rows.popleft() for _ in range(len(rows))]
