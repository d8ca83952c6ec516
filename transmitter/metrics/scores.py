"""How well the far end knew the plant: errors kept as running figures, never as lists.

Two errors are kept for every tick of the window. *Coded* is the codec's own error at that tick, as in
the paper; *live* is the error of the receiver's predicted estimate when it had to decide the
tick's command, prediction included. Both are against the true angle where the rig knows it, else
against the encoder.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable

from channel.codec.codec import Model, Vector

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
        size = error if error >= 0.0 else -error
        if size > self.largest:
            self.largest = size
        self._sum_of_squares += error * error

    @property
    def rms(self) -> float | None:
        """Return the root mean square; None without a value."""
        return math.sqrt(self._sum_of_squares / self.count) if self.count else None


class Scores:
    """Collects the errors of a flight from tick `window_start_tick` on.

    `span_ticks` bounds how long an angle waits for its estimate; older ones are forgotten.
    `on_live_error` gets every live error of the window, rad.
    """

    def __init__(
        self,
        model: Model,
        window_start_tick: int,
        span_ticks: int,
        reference: Reference,
        on_live_error: Callable[[float], None] = lambda _: None,
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
        self._on_live_error = on_live_error
        # An estimate may come before its angle (the echo of a sample's first tick speaks of all its
        # ticks) or long after it; each waits for the other.
        self._angles: deque[tuple[int, float]] = deque(maxlen=span_ticks)
        self._estimates: deque[tuple[int, float, float | None]] = deque(maxlen=span_ticks)

    def forget_reference(self) -> None:
        """Score no more tracking: the set-point is no longer the one that is known here."""
        self._reference = lambda _tick: None

    def on_angles(self, tick: int, angles_rad: Vector) -> None:
        """Note the angles of a tick; ticks come in order."""
        angle = angles_rad[0]
        self.last_angle_rad = angle
        if tick >= self.window_start_tick:
            if angle > self.angle_max_rad or -angle > self.angle_max_rad:
                self.angle_max_rad = abs(angle)
            reference = self._reference(tick)
            if reference is not None:
                if reference > self.reference_max_rad or -reference > self.reference_max_rad:
                    self.reference_max_rad = abs(reference)
                self.tracking.add(reference - angle)
        self._angles.append((tick, angle))
        self._join()

    def on_estimate(self, tick: int, coded: Vector, live: Vector | None) -> None:
        """Note what was estimated of a tick; ticks come in order."""
        measured = self._model.measured
        self._estimates.append((tick, measured(coded)[0], None if live is None else measured(live)[0]))
        self._join()

    def _join(self) -> None:
        """Score every tick of which both sides are known; forget those that one side skipped."""
        angles, estimates = self._angles, self._estimates
        while angles and estimates:
            if angles[0][0] < estimates[0][0]:
                angles.popleft()
            elif estimates[0][0] < angles[0][0]:
                estimates.popleft()
            else:
                self._score(angles.popleft()[1], *estimates.popleft())

    def _score(self, angle: float, tick: int, coded: float, live: float | None) -> None:
        self.last_coded_error_rad = angle - coded
        if tick >= self.window_start_tick:
            self.coded.add(angle - coded)
            if live is not None:
                self.live.add(angle - live)
                self._on_live_error(angle - live)
