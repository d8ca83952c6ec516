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
    """Measures symbols per second on the receiver's clock, over its last 5 s."""

    SPAN_NS = 5_000_000_000

    def __init__(self) -> None:
        self._times_ns: deque[int] = deque()
        self._last_ns = 0

    def on_slot(self, now_ns: int, *, came: bool) -> None:
        """Count a slot that is decided now; `came`: its symbol is there."""
        self._last_ns = now_ns
        if came:
            self._times_ns.append(now_ns)
        # The last symbol before the span bounds its first interval.
        while len(self._times_ns) > 1 and self._times_ns[1] <= now_ns - self.SPAN_NS:
            self._times_ns.popleft()

    @property
    def baud(self) -> float | None:
        """Return the measured rate; None before two symbols came at different times."""
        if not self._times_ns:
            return None
        span_ns = self._last_ns - self._times_ns[0]
        return (len(self._times_ns) - 1) * 1e9 / span_ns if span_ns > 0 else None
