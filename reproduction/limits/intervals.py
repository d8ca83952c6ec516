"""Means over seeds with their 95 % intervals."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from scipy.stats import t as student


@dataclass(frozen=True, slots=True)
class Ratio:
    """A ratio of root mean squares, with half the width of its 95 % interval."""

    value: float
    half: float

    def __str__(self) -> str:
        if not math.isfinite(self.value):
            return "lost"
        if self.value >= 10.0:
            return f"{self.value:.1f} +- {self.half:.1f}"
        return f"{self.value:.2f} +- {self.half:.2f}"


def quantile_95(count: int) -> float:
    """Return the half width of the 95 % interval of a mean of `count` values, in standard errors."""
    return float(student.ppf(0.975, count - 1)) if count > 1 else math.inf


def mean_of(values: Sequence[float]) -> Ratio:
    """Return the mean of independent values with its interval."""
    count = len(values)
    mean = sum(values) / count
    if not math.isfinite(mean):
        return Ratio(math.inf, math.inf)
    variance = sum((one - mean) ** 2 for one in values) / max(1, count - 1)
    return Ratio(mean, quantile_95(count) * math.sqrt(variance / count))


def ratio(mean_squares: Sequence[float], floor: float) -> Ratio:
    """Return the root mean square over the seeds, over the floor's root, with its 95 % interval.

    The seeds' mean squares are independent; the interval is that of their mean, carried through the
    square root.
    """
    mean = mean_of(mean_squares)
    if not math.isfinite(mean.value):
        return mean
    value = math.sqrt(mean.value / floor)
    return Ratio(value, 0.5 * value * mean.half / mean.value)


def paired(mean_squares: Sequence[float], others: Sequence[float]) -> Ratio:
    """Return the rms over another's on the same seeds: the geometric mean of the seeds' ratios.

    What a seed makes easy or hard for both drops out, so that less is left to chance than in the
    two figures taken apart.
    """
    if not all(map(math.isfinite, (*mean_squares, *others))):
        return Ratio(math.inf, math.inf)
    logs = mean_of(
        [0.5 * math.log(one / other) for one, other in zip(mean_squares, others, strict=True)]
    )
    value = math.exp(logs.value)
    return Ratio(value, value * logs.half)


def exponent(rates: Sequence[float], mean_squares: Sequence[Sequence[float]]) -> Ratio:
    """Return the slope of log rms against log rate with its 95 % interval.

    One slope per seed, each over all rates; the interval is that of their mean.
    """
    logs = [math.log(rate) for rate in rates]
    middle = sum(logs) / len(logs)
    spread = sum((one - middle) ** 2 for one in logs)
    slopes = []
    for squares in zip(*mean_squares, strict=True):
        heights = [0.5 * math.log(one) for one in squares]
        slopes.append(sum((x - middle) * y for x, y in zip(logs, heights, strict=True)) / spread)
    return mean_of(slopes)
