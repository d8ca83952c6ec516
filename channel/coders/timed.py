"""One-bit coders whose range does not listen: a fixed range, and time-based zooming.

The word is that of the paper's coder, a sign per axis (20), and so is the correction (21)-(23). Only
the range differs. It follows the clock alone:

    M_{k+1} = (1 - rho) M_min + rho M_k

which with rho = 1 stays at M_0: the fixed range. Such a coder can fall asleep: once the range is down,
an error that has grown beyond what the small range corrects is never caught up. It is here to show
what the adaptive rule (19) is for.
"""

from __future__ import annotations

from dataclasses import dataclass

from channel.codec import Vector
from channel.coders.signs import Gains, axes_of, scaled, signs_of, spread
from channel.words import Alphabet, Word


@dataclass(frozen=True, slots=True)
class TimedParameters:
    """Constants of the range and the observer gains."""

    initial_range: float = 0.5
    """M_0, in the unit of the measurement (rad)"""
    minimum_range: float = 0.05
    """M_min, where the range ends"""
    decay: float = 0.95
    """rho, in (0, 1]; 1 keeps the range as it is"""
    gains: Gains = ((4.1,), (8.6,))
    """a row per corrected model state, a column per measured axis"""
    impulse: bool = False


class TimedCoder:
    """A sign per axis, and ranges that shrink by the clock. Coder state: the ranges."""

    uses_rates = False

    def __init__(self, parameters: TimedParameters) -> None:
        axes = axes_of(parameters.gains)
        if not 0.0 < parameters.decay <= 1.0:
            raise ValueError(f"decay must be in (0, 1], got {parameters.decay}")
        self.parameters = parameters
        self.impulse = parameters.impulse
        self.axes = axes
        self.alphabet = Alphabet((-1, 1), axes)
        self._floor = (1.0 - parameters.decay) * parameters.minimum_range

    def initial(self) -> Vector:
        """Return `M_0` for every axis."""
        return (self.parameters.initial_range,) * self.axes

    def encode(self, coder: Vector, predicted: Vector, measurement: Vector) -> tuple[int, ...]:
        """Return the sign of the estimation error of each axis (20)."""
        return signs_of(predicted, measurement, self.axes)

    def decode(self, coder: Vector, state: Vector, word: Word) -> tuple[Vector, Vector]:
        """Return the correction (21),(23) and the ranges of the next sample."""
        decay = self.parameters.decay
        correction = spread(scaled(coder, word), self.parameters.gains)
        return correction, tuple(self._floor + decay * one for one in coder)

    def ranges(self, coder: Vector) -> Vector:
        """Return the range `M_k` of each axis."""
        return coder
