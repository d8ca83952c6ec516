"""State filters (7): derivatives of a signal, filtered, without differentiating it.

    D(p) x = g s,   D(p) = p^n + d_1 p^(n-1) + ... + d_n,   g the scale

The filter's states are x, x', ..., x^(n-1); from them and the signal follows x^(n) as well. Every
signal of a regression passes through an equal filter, so the regression holds between the filtered
signals as it does between the raw ones. Between two samples a signal is taken as a straight line (a
first-order hold, exact for the filter), which suits sampled angles and lagging voltages alike.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from plant_sim.identification.errors import IdentificationError

Array = NDArray[np.float64]


def require_hurwitz(polynomial: Sequence[float]) -> tuple[float, ...]:
    """Return (1, d_1, ..., d_n); IdentificationError unless every root has a negative real part."""
    coefficients = tuple(float(value) for value in polynomial)
    if len(coefficients) < 2 or not np.all(np.isfinite(coefficients)):
        raise IdentificationError(
            f"the filter polynomial {coefficients} needs at least two finite coefficients, the "
            "highest power first"
        )
    if coefficients[0] != 1.0:
        raise IdentificationError(
            f"the filter polynomial {coefficients} must begin with 1: divide it by {coefficients[0]:g}"
        )
    worst = max(np.roots(coefficients).real)
    if worst >= 0.0:
        raise IdentificationError(
            f"the filter polynomial {coefficients} is not Hurwitz: it has a root with real part "
            f"{worst:.3g}, so the filter would not settle; choose one with all roots left of zero"
        )
    return coefficients


def second_order(bandwidth_rad_s: float, damping: float) -> tuple[float, float, float]:
    """Return D(p) = p^2 + 2 rho w_f p + w_f^2 of (13)-(15)."""
    return (1.0, 2.0 * damping * bandwidth_rad_s, bandwidth_rad_s * bandwidth_rad_s)


class StateFilter:
    """One filter; `scale` is g. With g = d_n a constant signal passes unchanged.

    Several signals of the same filter go through one object: `count` of them, as columns.
    """

    def __init__(
        self, polynomial: Sequence[float], step_s: float, *, scale: float = 1.0, count: int = 1
    ) -> None:
        if not (np.isfinite(step_s) and step_s > 0.0):
            raise IdentificationError(f"the sampling time is {step_s} s; it must be above 0")
        self.polynomial = require_hurwitz(polynomial)
        self.order = len(self.polynomial) - 1
        self._scale = scale
        n = self.order
        # (x, s, ds/dt) under a ramp: one matrix exponential gives the exact step.
        augmented = np.zeros((n + 2, n + 2))
        augmented[: n - 1, 1:n] = np.eye(n - 1)
        augmented[n - 1, :n] = [-value for value in reversed(self.polynomial[1:])]
        augmented[n - 1, n] = scale
        augmented[n, n + 1] = 1.0
        step = expm(augmented * step_s)
        self._advance: Array = step[:n, :n]
        slope = step[:n, n + 1] / step_s
        self._from_before: Array = (step[:n, n] - slope)[:, None]
        self._from_now: Array = slope[:, None]
        self._feedback: Array = augmented[n - 1, :n].copy()
        self._before: Array | None = None
        self.states: Array = np.zeros((n, count))
        """row i: the i-th derivative of x"""

    def take(self, signals: Array) -> None:
        """Take the next sample of every signal; the first one starts the filter at rest there."""
        if self._before is None:
            self.states[:] = 0.0
            self.states[0] = signals * (self._scale / self.polynomial[-1])
        else:
            self.states = (
                self._advance @ self.states
                + self._from_before * self._before
                + self._from_now * signals
            )
        self._before = signals

    @property
    def highest(self) -> Array:
        """Return x^(n) of every signal."""
        before = self._before
        if before is None:
            raise IdentificationError("the filter has not taken a sample yet")
        return np.asarray(self._feedback @ self.states + self._scale * before)
