"""Curves of any length in bounded memory, thinned to the resolution of a picture.

Time is divided into stretches of one width, which doubles as the curve grows. Of every stretch the
lowest and the highest point are kept, and one gap if there is one. The extremes of extremes are
extremes, so it does not matter in how many pieces a curve came.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Series = NDArray[np.float64]
Curve = tuple[Series, Series]
"""times and values"""

POINTS = 8000
"""Of a thinned curve; gaps may add half as many."""
GAP_STEPS = 5.0
"""Usual steps without a row that interrupt a curve: a straight line would pass for a flight."""


class Envelope:
    """Values over time in seconds; NaN interrupts the curve."""

    def __init__(self, points: int = POINTS) -> None:
        self._points = points
        self._times: list[Series] = []
        self._values: list[Series] = []
        self._held = 0
        self._usual_s = 0.0
        self._last_s = np.nan

    def add(self, times: Series, values: Series) -> None:
        """Add points, in order of time but for some that come late."""
        if not len(times):
            return
        times, values = self._interrupted(times, values)
        self._times.append(times)
        self._values.append(values)
        self._held += len(times)
        if self._held > 4 * self._points:
            thinned = thin(*self.points(), self._points)
            self._times, self._values = [thinned[0]], [thinned[1]]
            self._held = len(thinned[0])

    def restore(self, times: Series, values: Series) -> None:
        """Take over a curve that was thinned already, its gaps included."""
        self._times, self._values, self._held = [times], [values], len(times)

    def points(self) -> tuple[Series, Series]:
        if not self._times:
            return np.zeros(0), np.zeros(0)
        times, values = np.concatenate(self._times), np.concatenate(self._values)
        if (np.diff(times) < 0.0).any():
            order = np.argsort(times, kind="stable")
            return times[order], values[order]
        return times, values

    def curve(self) -> tuple[Series, Series]:
        return thin(*self.points(), self._points)

    def _interrupted(self, times: Series, values: Series) -> tuple[Series, Series]:
        before = np.concatenate(([self._last_s], times[:-1]))
        steps = times - before
        self._last_s = float(times[-1])
        known = steps[~np.isnan(steps)]
        if not self._usual_s and len(known):
            self._usual_s = float(np.median(known))
        if self._usual_s <= 0.0:
            return times, values
        after = np.flatnonzero(steps > GAP_STEPS * self._usual_s)
        if not len(after):
            return times, values
        return np.insert(times, after, before[after]), np.insert(values, after, np.nan)


class Means:
    """Values over time of which, once there are too many, the mean of each stretch is kept."""

    def __init__(self, points: int) -> None:
        self._points = points
        self._times, self._sums, self._counts = np.zeros(0), np.zeros(0), np.zeros(0)
        self.thinned = False

    def add(self, times: Series, values: Series) -> None:
        """Add values; a NaN does not count."""
        known = ~np.isnan(values)
        self._times = np.concatenate((self._times, times))
        self._sums = np.concatenate((self._sums, np.where(known, values, 0.0)))
        self._counts = np.concatenate((self._counts, known.astype(np.float64)))
        if len(self._times) > 4 * self._points:
            self._thin()

    def curve(self) -> tuple[Series, Series]:
        """Return time and mean of every stretch; NaN where no value was known."""
        if len(self._times) > self._points:
            self._thin()
        with np.errstate(invalid="ignore"):
            return self._times, self._sums / self._counts

    def restore(self, times: Series, means: Series, thinned: bool) -> None:
        """Load the result of another one's `curve`."""
        self.add(times, means)
        self.thinned = thinned

    def _thin(self) -> None:
        order = np.argsort(self._times, kind="stable")
        self._times, self._sums, self._counts = (
            held[order] for held in (self._times, self._sums, self._counts)
        )
        starts = stretches(self._times, self._points)
        self._times = self._times[starts]
        self._sums = np.add.reduceat(self._sums, starts)
        self._counts = np.add.reduceat(self._counts, starts)
        self.thinned = True


def stretches(times: Series, count: int) -> NDArray[np.intp]:
    """Return where each stretch begins among points by time; at most `count` + 1 stretches."""
    span = float(times[-1] - times[0])
    if not span > 0.0:
        return np.zeros(1, dtype=np.intp)
    # A power of two: later, wider stretches are made of whole earlier ones.
    width = 2.0 ** np.ceil(np.log2(span / count))
    numbers = np.floor(times / width)
    return np.flatnonzero(np.diff(numbers, prepend=numbers[0] - 1.0))


def thin(times: Series, values: Series, points: int) -> tuple[Series, Series]:
    """Thin a curve to its `extremes`."""
    if len(values) <= points:
        return times, values
    chosen = extremes(times, values, points)
    return times[chosen], values[chosen]


def extremes(times: Series, values: Series, points: int) -> NDArray[np.intp]:
    """Return the places of some `points` points: the lowest and highest of every stretch of time.

    A stretch with a NaN keeps one, so that the curve stays interrupted there; such a stretch may have
    three points.
    """
    starts = stretches(times, points // 2)
    lengths = np.diff(np.append(starts, len(values)))
    kept = [
        _first_of(values == np.repeat(extreme, lengths), starts, lengths)
        for extreme in (np.fmin.reduceat(values, starts), np.fmax.reduceat(values, starts))
    ]
    kept.append(_first_of(np.isnan(values), starts, lengths))
    return np.unique(np.concatenate(kept))


def _first_of(
    wanted: NDArray[np.bool_], starts: NDArray[np.intp], lengths: NDArray[np.intp]
) -> NDArray[np.intp]:
    """Return the first wanted point of every stretch that has one."""
    found = np.flatnonzero(wanted)
    stretch = np.repeat(np.arange(len(starts)), lengths)[found]
    return found[np.diff(stretch, prepend=-1) > 0]
