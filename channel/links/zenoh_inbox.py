"""Two ways to take in what Zenoh delivers: the one waits to the millisecond, the other is quicker.

On the real clock a wait has a deadline. Zenoh's own channel cannot wait with one, so its thread hands
every message to a queue that can. On the virtual clock an end waits for one message and nothing else:
there the loop's thread takes it from Zenoh's channel itself, which saves a change of threads per
message, and a local message ten times a second lets it look at the time.
"""

from __future__ import annotations

import threading
import time
from collections import Counter
from queue import Empty, SimpleQueue
from typing import Protocol

import zenoh

QUEUE_MESSAGES_MAX = 10_000
WAKE_PERIOD_S = 0.1


class Inbox(Protocol):
    """Messages that have come in, in order."""

    def get(self, timeout_s: float) -> bytes | None:
        """Return the next message, or None after `timeout_s` seconds (0: only what is there)."""

    def close(self) -> None:
        """Stop taking messages; to be called before the Zenoh session is closed."""


class QueueInbox:
    """Waits with a deadline. A full queue drops the message and counts it."""

    def __init__(self, session: zenoh.Session, key: str, dropped: Counter[str]) -> None:
        self._dropped = dropped
        self._queue: SimpleQueue[bytes] = SimpleQueue()
        # Runs on a thread of Zenoh and calls nothing of Zenoh: it only hands over.
        handler = zenoh.handlers.Callback(self._take, indirect=False)
        self._subscriber = session.declare_subscriber(key, handler)

    def get(self, timeout_s: float) -> bytes | None:
        """Return the next message, or None after `timeout_s` seconds."""
        try:
            return self._queue.get(timeout_s > 0.0, timeout_s if timeout_s > 0.0 else None)
        except Empty:
            return None

    def close(self) -> None:
        """Stop taking messages."""
        self._subscriber.undeclare()

    def _take(self, sample: zenoh.Sample) -> None:
        if self._queue.qsize() >= QUEUE_MESSAGES_MAX:
            self._dropped["queue full"] += 1
        else:
            self._queue.put(sample.payload.to_bytes())


class ChannelInbox:
    """Quicker, with deadlines kept to a tenth of a second. A full channel holds the sender up."""

    def __init__(self, session: zenoh.Session, key: str) -> None:
        self._subscriber = session.declare_subscriber(
            key, zenoh.handlers.FifoChannel(QUEUE_MESSAGES_MAX)
        )
        self._session = session
        self._wake_key = key.replace("*", "wake")
        self._stop = threading.Event()
        self._waker = threading.Thread(target=self._wake, name="zenoh-wake", daemon=True)
        self._waker.start()

    def get(self, timeout_s: float) -> bytes | None:
        """Return the next message, or None after `timeout_s` seconds or up to 0.1 s more."""
        deadline_s = time.monotonic() + timeout_s
        while True:
            sample = self._subscriber.recv() if timeout_s > 0.0 else self._subscriber.try_recv()
            if sample is None:
                return None
            data = sample.payload.to_bytes()
            # Only our own wake-ups are empty: no frame and no envelope is.
            if data or str(sample.key_expr) != self._wake_key:
                return data
            if time.monotonic() >= deadline_s:
                return None

    def close(self) -> None:
        """Stop taking messages. A channel left full would hang the closing session."""
        self._stop.set()
        self._waker.join()
        self._subscriber.undeclare()

    def _wake(self) -> None:
        while not self._stop.wait(WAKE_PERIOD_S):
            self._session.put(self._wake_key, b"", allowed_destination=zenoh.Locality.SESSION_LOCAL)
