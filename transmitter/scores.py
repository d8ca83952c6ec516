"""How well the far end knew the plant: errors kept as running figures, never as lists.

Two errors are kept for every tick of the window. *Coded* is the codec's own error at that tick, as in
the paper; *live* is the error of what the receiver believed about the tick when it had to decide the
tick's command, prediction included. Both are against the true angle where the rig knows it, else
against the encoder.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable

from channel.codec import Model, Vector

Reference = Callable[[int], float | None]
"""Set-point of the first axis at a tick, rad; None where there is none."""


class ErrorMeter:
    """Largest and root-mean-square value of a stream of errors."""

    def __init__(self) -> None:
        self.count = 0
        self.largest = 0.0
        self._sum_of_squares = 0.0

    def add(self, error: float) -> None:
        """Take one error."""
        self.count += 1
        self.largest = max(self.largest, abs(error))
        self._sum_of_squares += error * error

    @property
    def rms(self) -> float | None:
        """Return the root mean square; None without a value."""
        return math.sqrt(self._sum_of_squares / self.count) if self.count else None


class Scores:
    """Collects the errors of a flight from tick `window_start_tick` on.

    `span_ticks` bounds how long an angle waits for its estimate; older ones are forgotten.
    """

    def __init__(
        self, model: Model, window_start_tick: int, span_ticks: int, reference: Reference
    ) -> None:
        self.window_start_tick = window_start_tick
        self.coded = ErrorMeter()
        self.live = ErrorMeter()
        self.tracking = ErrorMeter()
        self.angle_max_rad = 0.0
        self.reference_max_rad = 0.0
        self.last_coded_error_rad: float | None = None
        self.last_angle_rad: float | None = None
        self._model = model
        self._reference = reference
        self._angles: deque[tuple[int, Vector]] = deque(maxlen=span_ticks)

    def on_angles(self, tick: int, angles_rad: Vector) -> None:
        """Note the angles of a tick."""
        self._angles.append((tick, angles_rad))
        self.last_angle_rad = angles_rad[0]
        if tick < self.window_start_tick:
            return
        self.angle_max_rad = max(self.angle_max_rad, abs(angles_rad[0]))
        reference = self._reference(tick)
        if reference is not None:
            self.reference_max_rad = max(self.reference_max_rad, abs(reference))
            self.tracking.add(reference - angles_rad[0])

    def on_estimate(self, tick: int, coded: Vector, live: Vector | None) -> None:
        """Compare the estimates of a tick with its angle; ticks come in order."""
        while self._angles and self._angles[0][0] < tick:
            self._angles.popleft()
        if not self._angles or self._angles[0][0] != tick:
            return
        angle = self._angles[0][1][0]
        error = angle - self._model.measured(coded)[0]
        self.last_coded_error_rad = error
        if tick < self.window_start_tick:
            return
        self.coded.add(error)
        if live is not None:
            self.live.add(angle - self._model.measured(live)[0])


class LatenessMeter:
    """Percentiles of how late the ticks began, in bins of 10 microseconds up to 50 ms."""

    BIN_NS = 10_000
    BINS = 5_000

    def __init__(self) -> None:
        self.count = 0
        self.largest_ns = 0
        self._bins = [0] * (self.BINS + 1)

    def add(self, lateness_ns: int) -> None:
        """Take one lateness."""
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
