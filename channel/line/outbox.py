"""Messages held back until the line would have delivered them: for senders on a real clock."""

from __future__ import annotations

import heapq
from collections.abc import Iterable, Iterator

from channel.line.line import Delivery


class Outbox:
    """A queue in order of due time; what is due at the same time leaves in order of arrival."""

    def __init__(self) -> None:
        self._waiting: list[tuple[int, int, bytes, bool]] = []
        self._order = 0

    def __len__(self) -> int:
        """Return how many messages wait."""
        return len(self._waiting)

    @property
    def next_due_ns(self) -> int | None:
        """Return when the next message is due, None when none waits."""
        return self._waiting[0][0] if self._waiting else None

    def put(self, deliveries: Iterable[Delivery], is_symbol: bool) -> None:
        """Hold what a line makes of a message; a lost one leaves nothing."""
        for delivery in deliveries:
            if delivery.data is not None:
                self._order += 1
                entry = (delivery.arrival_ns, self._order, delivery.data, is_symbol)
                heapq.heappush(self._waiting, entry)

    def take(self, now_ns: int) -> Iterator[tuple[bytes, bool]]:
        """Yield (message, whether it is a symbol) of all that is due by now."""
        while self._waiting and self._waiting[0][0] <= now_ns:
            _, _, data, is_symbol = heapq.heappop(self._waiting)
            yield data, is_symbol
