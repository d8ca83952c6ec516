"""The paper's coder (16)-(22): one sign per measured axis, scaled by a range that adjusts itself.

The word of sample `k` is `sigma_k = sign(y - y_hat)` per axis, `sign(0) = +1`. Both ends take the
error for `M_k sigma_k` and correct the observer by `gains * M_k sigma_k`. The mean `lambda_k` of
the last `window` signs tells whether the coder is saturated (19):

    M_{k+1} = (1 - rho) M_min + (rho M_k  if |lambda_k| <= 0.5  else  M_k / rho)

An erased word corrects nothing and enters the window as a zero.
"""

from __future__ import annotations

from dataclasses import dataclass

from channel.codec import Vector
from channel.words import ERASED, Alphabet, Word


@dataclass(frozen=True, slots=True)
class ZoomParameters:
    """Constants of (19) and the observer gains. Defaults are the paper's."""

    initial_range: float = 0.5
    """M_0, in the unit of the measurement (rad)"""
    minimum_range: float = 0.05
    """M_min"""
    decay: float = 0.95
    """rho, in (0, 1]"""
    window: int = 2
    """how many signs `lambda_k` is the mean of; the paper's (19) has two"""
    gains: tuple[tuple[float, ...], ...] = ((4.1,), (8.6,))
    """a row per corrected model state, a column per measured axis: l1 and l2 of (23)"""
    impulse: bool = False
    """False: the correction is held over the sample as in (22); True: applied to the state at once"""


class ZoomCoder:
    """One sign and one self-adjusting range per measured axis.

    Coder state: the ranges of all axes, then the last `window - 1` signs of each axis, newest first.
    """

    uses_rates = False

    def __init__(self, parameters: ZoomParameters) -> None:
        axes = len(parameters.gains[0]) if parameters.gains else 0
        if axes < 1 or any(len(row) != axes for row in parameters.gains):
            raise ValueError(f"gains need rows of equal, non-zero length, got {parameters.gains}")
        if not 0.0 < parameters.decay <= 1.0:
            raise ValueError(f"decay must be in (0, 1], got {parameters.decay}")
        if parameters.window < 1:
            raise ValueError(f"window must be at least 1 sign, got {parameters.window}")
        self.parameters = parameters
        self.impulse = parameters.impulse
        self.axes = axes
        self.alphabet = Alphabet((-1, 1), axes)
        self._floor = (1.0 - parameters.decay) * parameters.minimum_range

    def initial(self) -> Vector:
        """Return `M_0` for every axis and an empty (zero) sign history."""
        history = self.axes * (self.parameters.window - 1)
        return (self.parameters.initial_range,) * self.axes + (0.0,) * history

    def encode(self, coder: Vector, predicted: Vector, measurement: Vector) -> tuple[int, ...]:
        """Return the sign of the estimation error of each axis (20)."""
        return tuple(1 if measurement[axis] >= predicted[axis] else -1 for axis in range(self.axes))

    def decode(self, coder: Vector, state: Vector, word: Word) -> tuple[Vector, Vector]:
        """Return the correction (21),(23) and the coder state after (19)."""
        signs = (0,) * self.axes if word is ERASED else word
        older = self.parameters.window - 1
        ranges = []
        history: list[float] = []
        for axis in range(self.axes):
            start = self.axes + axis * older
            window = (float(signs[axis]), *coder[start : start + older])
            ranges.append(self._next_range(coder[axis], window))
            history.extend(window[:older])
        errors = [coder[axis] * signs[axis] for axis in range(self.axes)]
        correction = []
        for row in self.parameters.gains:
            total = 0.0
            for axis in range(self.axes):
                total += row[axis] * errors[axis]
            correction.append(total)
        return tuple(correction), (*ranges, *history)

    def ranges(self, coder: Vector) -> Vector:
        """Return the range `M_k` of each axis."""
        return coder[: self.axes]

    def _next_range(self, current: float, window: tuple[float, ...]) -> float:
        total = 0.0
        for sign in window:
            total += sign
        # |lambda| <= 0.5 without a division: the signs are small whole numbers, so this is exact.
        saturated = 2.0 * total > len(window) or 2.0 * total < -len(window)
        decay = self.parameters.decay
        return self._floor + (current / decay if saturated else decay * current)
