"""Meters of a loop: its lateness, and the symbols that arrive per second."""

from __future__ import annotations


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
    """Measures symbols per second on the receiver's clock, between the first symbol and the last."""

    def __init__(self) -> None:
        self.symbols = 0
        self._first_ns = 0
        self._last_ns = 0

    def on_symbol(self, now_ns: int) -> None:
        if self.symbols == 0:
            self._first_ns = now_ns
        self._last_ns = now_ns
        self.symbols += 1

    @property
    def baud(self) -> float | None:
        """Return the measured rate; None before two symbols came at different times."""
        span_ns = self._last_ns - self._first_ns
        return (self.symbols - 1) * 1e9 / span_ns if span_ns > 0 else None
