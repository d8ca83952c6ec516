"""How sure the transmitter was of its receiver over a flight: its hypotheses, and its confirmations."""

from __future__ import annotations

from collections import Counter


class Certainty:
    """Counts the hypotheses after each sample heard of, and how long each confirmation took."""

    def __init__(self) -> None:
        self.size_max = 0
        """largest number of hypotheses"""
        self._heard = self._sizes = 0
        self._delays: Counter[int] = Counter()

    def on_heard(self, size: int) -> None:
        """Count a sample heard of; `size` hypotheses are followed after it."""
        self._heard += 1
        self._sizes += size
        if size > self.size_max:
            self.size_max = size

    def on_confirmed(self, delay_samples: int) -> None:
        """Count a sample that was confirmed `delay_samples` after its own."""
        self._delays[delay_samples] += 1

    @property
    def size_mean(self) -> float | None:
        return self._sizes / self._heard if self._heard else None

    @property
    def delay_max(self) -> int | None:
        return max(self._delays, default=None)

    @property
    def delay_median(self) -> int | None:
        left = -(-self._delays.total() // 2)
        for delay in sorted(self._delays):
            left -= self._delays[delay]
            if left <= 0:
                return delay
        return None
