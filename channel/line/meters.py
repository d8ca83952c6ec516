"""Meters of a loop: its lateness, and the symbols that arrive per second."""

from __future__ import annotations

from collections import deque


class LatenessMeter:
    """Percentiles of lateness, in bins of 10 microseconds up to 50 ms."""

    BIN_NS = 10_000
    BINS = 5_000

    def __init__(self) -> None:
        self.count = 0
        self.largest_ns = 0
        self._bins = [0] * (self.BINS + 1)

    def add(self, lateness_ns: int) -> None:
        self.count += 1
        self.largest_ns = max(self.largest_ns, lateness_ns)
        self._bins[min(max(lateness_ns, 0) // self.BIN_NS, self.BINS)] += 1

    def percentile_ms(self, percent: float) -> float | None:
        """Return the lateness that this percentage of ticks did not exceed; None without ticks."""
        if self.count == 0:
            return None
        left = percent / 100.0 * self.count
        for index, number in enumerate(self._bins):
            left -= number
            if left <= 0.0 and index < self.BINS:
                return min((index + 1) * self.BIN_NS, self.largest_ns) / 1e6
        return self.largest_ns / 1e6


class BaudMeter:
    """Measures symbols per second on the receiver's clock: of its last 5 s and of the whole flight."""

    SPAN_NS = 5_000_000_000

    def __init__(self) -> None:
        self._times_ns: deque[int] = deque()
        self._last_ns = self._first_came_ns = self._last_came_ns = 0
        self._came = 0

    def on_slot(self, now_ns: int, *, came: bool) -> None:
        """Count a slot that is decided now; `came`: its symbol is there."""
        self._last_ns = now_ns
        if came:
            if not self._came:
                self._first_came_ns = now_ns
            self._last_came_ns = now_ns
            self._came += 1
            self._times_ns.append(now_ns)
        # The last symbol before the span bounds its first interval.
        while len(self._times_ns) > 1 and self._times_ns[1] <= now_ns - self.SPAN_NS:
            self._times_ns.popleft()

    @property
    def baud(self) -> float | None:
        """Return the rate of the last 5 s; None before two symbols came at different times."""
        if not self._times_ns:
            return None
        return _rate(len(self._times_ns), self._last_ns - self._times_ns[0])

    @property
    def whole_baud(self) -> float | None:
        """Return the rate from the first symbol to the last one; None as with `baud`."""
        return _rate(self._came, self._last_came_ns - self._first_came_ns)


def _rate(came: int, span_ns: int) -> float | None:
    return (came - 1) * 1e9 / span_ns if span_ns > 0 else None
