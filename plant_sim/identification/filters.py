"""State filters (7): derivatives of a signal, filtered, without differentiating it.

    D(p) x = g s,   D(p) = p^n + d_1 p^(n-1) + ... + d_n,   g = d_n

The filter's states are x, x', ..., x^(n-1); from them and the signal follows x^(n) as well. Every
signal of a regression passes through an equal filter, so the regression holds between the filtered
signals as it does between the raw ones. Between two samples an output is taken as a straight line, an
input as held, behind its motor's lag; both are exact for the filter.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm
from scipy.signal import butter, lfilter, lfilter_zi, ss2tf

from plant_sim.identification.errors import IdentificationError

Array = NDArray[np.float64]


def low_pass(order: int, bandwidth_rad_s: float, damping: float) -> tuple[float, ...]:
    """Return D(p): p^2 + 2 rho w_f p + w_f^2 of (13)-(15), or a Butterworth filter of another order."""
    if not (bandwidth_rad_s > 0.0 and damping > 0.0):
        raise IdentificationError(
            f"filter bandwidth {bandwidth_rad_s:g} rad/s and damping {damping:g} must both be above "
            "0, or the state filters do not settle"
        )
    if order == 2:
        return 1.0, 2.0 * damping * bandwidth_rad_s, bandwidth_rad_s**2
    return tuple(butter(order, bandwidth_rad_s, analog=True)[1].tolist())


@dataclass(slots=True)
class SignalFilter:
    """The filter of one signal, which is taken piece by piece.

    `held`: the signal is held from a sample to the next one and passes a lag of `lag_s` first;
    otherwise it is a straight line between samples. It rests at `start` before the first sample.
    """

    polynomial: Sequence[float]
    step_s: float
    start: float
    held: bool = False
    lag_s: float = 0.0
    _numerators: Array = field(init=False)
    _denominator: Array = field(init=False)
    _memory: dict[int, Array] = field(init=False, default_factory=dict)

    def __post_init__(self) -> None:
        """Discretise the filter exactly."""
        coefficients = self.polynomial
        order = len(coefficients) - 1
        lagging = 1 if self.held and self.lag_s > 0.0 else 0
        size = order + lagging
        # States x, x', ..., then the lagging signal, then the signal and its slope.
        system = np.zeros((size + 2, size + 2))
        system[: order - 1, 1:order] = np.eye(order - 1)
        system[order - 1, :order] = [-value for value in reversed(coefficients[1:])]
        system[order - 1, order] = coefficients[-1]
        if lagging:
            system[order, order] = -1.0 / self.lag_s
            system[order, order + 1] = 1.0 / self.lag_s
        system[size, size + 1] = 1.0
        step = expm(system * self.step_s)
        F = step[:size, :size]
        now = np.zeros(size) if self.held else step[:size, size + 1] / self.step_s
        before = step[:size, size] - now
        seen = np.vstack((np.eye(size)[:order], system[order - 1, :size]))
        through = seen @ now
        if not lagging:
            through[order] += coefficients[-1]
        drive = (before + F @ now)[:, None]
        self._numerators, self._denominator = ss2tf(F, drive, seen, through[:, None])

    def take(self, signal: Array, derivative: int) -> Array:
        """Return a derivative of the filtered signal for the next samples, each piece once."""
        numerator = self._numerators[derivative]
        memory = self._memory.get(derivative)
        if memory is None:
            memory = lfilter_zi(numerator, self._denominator) * self.start
        filtered, self._memory[derivative] = lfilter(numerator, self._denominator, signal, zi=memory)
        return np.asarray(filtered)

    def modes(self, first: int, count: int) -> Array:
        """Return the filter's own motions from sample `first` on: a column for each of its states."""
        order = len(self.polynomial) - 1
        companion = np.eye(order, k=1)
        companion[-1] = [-value for value in reversed(self.polynomial[1:])]
        roots, vectors = np.linalg.eig(companion)
        weights = np.linalg.inv(vectors)
        scale = abs(self.polynomial[-1]) ** (1.0 / order)
        times = np.arange(first, first + count) * self.step_s
        decays = np.exp(np.outer(times, roots))
        columns = [
            (decays @ (vectors[0] * weights[:, state])).real * scale**state for state in range(order)
        ]
        return np.stack(columns, axis=1)


def lagged(signal: Array, step_s: float, lag_s: float, start: Array | float) -> Array:
    """Return (12): the lagging signal at every sample, of columns that are held between samples."""
    if lag_s <= 0.0:
        return signal
    left = math.exp(-step_s / lag_s)
    memory = np.broadcast_to(np.asarray(start, dtype=np.float64), signal.shape[1:])[None]
    # y[k + 1] = left y[k] + (1 - left) u[k], from y[0] = start
    filtered, _ = lfilter([0.0, 1.0 - left], [1.0, -left], signal, axis=0, zi=memory)
    return np.asarray(filtered)
