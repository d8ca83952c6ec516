"""A link inside one process, for simulations and tests: two queues and nothing else.

It loses and delays nothing, but it promises no more than any link: what is sent to an end that has
been closed is gone.
"""

from __future__ import annotations

from queue import Empty, SimpleQueue

from channel.errors import LinkError
from channel.links.base import Link

QUEUE_MESSAGES_MAX = 100_000


class MemoryLink(Link):
    """One end of a pair made by `memory_pair`."""

    name = "memory"

    def __init__(self) -> None:
        super().__init__()
        self._inbox: SimpleQueue[bytes] = SimpleQueue()
        self._peer: MemoryLink | None = None
        self._open = True

    def send(self, data: bytes) -> None:
        """Hand a message to the other end."""
        if not self._open:
            raise LinkError("the link is closed")
        self.counts.messages_out += 1
        self.counts.bytes_out += len(data)
        if self._peer is not None and self._peer._open:
            self._peer._take(data)

    def receive(self, timeout_s: float) -> bytes | None:
        """Return the next message, or None after `timeout_s` seconds."""
        try:
            data = self._inbox.get(timeout_s > 0.0, timeout_s if timeout_s > 0.0 else None)
        except Empty:
            return None
        self.counts.messages_in += 1
        self.counts.bytes_in += len(data)
        return data

    def peer_present(self) -> bool:
        """Return whether the other end is open."""
        return self._peer is not None and self._peer._open

    def close(self) -> None:
        """Stop taking messages."""
        self._open = False

    def _take(self, data: bytes) -> None:
        if self._inbox.qsize() >= QUEUE_MESSAGES_MAX:
            self.counts.dropped["queue full"] += 1
        else:
            self._inbox.put(data)


def memory_pair() -> tuple[MemoryLink, MemoryLink]:
    """Return the two ends of a new link."""
    left, right = MemoryLink(), MemoryLink()
    left._peer, right._peer = right, left
    return left, right
