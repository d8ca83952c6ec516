"""The least-squares estimator (9), (10), with what a person needs to trust its answer.

    Omega' = -Gamma phi phi' Omega + Gamma phi xi                                    (9)
    Gamma' = -Gamma phi phi' Gamma + alpha Gamma                                     (10)

(10) is the same as (Gamma^-1)' = phi phi' - alpha Gamma^-1, which over one step of length h has the
solution Gamma^-1 <- exp(-alpha h) Gamma^-1 + h phi phi'. That is recursive least squares with
forgetting; taken in this form it cannot lose its positive definiteness as a plain Euler step can.

When the excitation fades, (10) lets Gamma grow like exp(alpha t) without bound, and the first noise
afterwards throws the estimates away. Here alpha is scaled by 1 - |Gamma| / bound, so that Gamma stays
below the bound and the estimates rest where the data left them.

The uncertainty does not assume white noise, because the state filters colour it: the scores
phi (xi - phi' Omega) are summed over blocks longer than the filters remember, and the covariance is
Gamma (sum of blocks squared) Gamma.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from plant_sim.identification.errors import IdentificationError

Array = NDArray[np.float64]

CONDITION_MIN = 1e-3
"""Smallest eigenvalue of the regressors' correlation matrix that still tells them apart; 1 would be
regressors without anything in common."""

UNCERTAINTY_MAX = 0.25
"""A standard error above this share of the estimate makes the estimate useless."""


class Estimator:
    """Estimates `size` parameters from one regression per step.

    `forgetting_per_s` is alpha, `gain` the diagonal of Gamma(0), `gain_bound` what the norm of Gamma
    may not exceed (ten times Gamma(0) if not given), `block_s` longer than the noise's memory.
    """

    def __init__(
        self,
        size: int,
        step_s: float,
        *,
        forgetting_per_s: float = 0.01,
        gain: float = 1e3,
        gain_bound: float | None = None,
        block_s: float = 6.0,
    ) -> None:
        bound = 10.0 * gain * math.sqrt(size) if gain_bound is None else gain_bound
        for name, value in (
            ("step_s", step_s),
            ("gain", gain),
            ("gain_bound", bound),
            ("block_s", block_s),
        ):
            if not (math.isfinite(value) and value > 0.0):
                raise IdentificationError(f"{name} is {value}; it must be finite and above 0")
        if not 0.0 <= forgetting_per_s < math.inf:
            raise IdentificationError(f"forgetting_per_s is {forgetting_per_s}; it must be at least 0")
        if bound < gain * math.sqrt(size):
            raise IdentificationError(f"gain_bound is {bound:g}, below Gamma(0) itself; raise it")
        self.estimates: Array = np.zeros(size)
        self.gain: Array = np.eye(size) * gain
        self._initial_gain = gain
        self._step_s = step_s
        self._forgetting = forgetting_per_s
        self._bound = bound
        self._moments: Array = np.zeros((size, size))
        self._weight = 0.0
        self._block_steps = max(1, round(block_s / step_s))
        self._block: Array = np.zeros(size)
        self._in_block = 0
        self._meat: Array = np.zeros((size, size))
        self.steps = 0

    def update(self, regressor: Array, target: float) -> None:
        """Take one row: `target` = `regressor` . parameters. ValueError if it is not finite."""
        if not (np.all(np.isfinite(regressor)) and math.isfinite(target)):
            raise IdentificationError(f"sample {self.steps} of the data is not finite")
        h = self._step_s
        size = float(np.sqrt((self.gain * self.gain).sum()))
        forgetting = self._forgetting * max(0.0, 1.0 - size / self._bound)
        kept = math.exp(-forgetting * h)
        pushed = self.gain @ regressor
        gain = pushed / (kept / h + float(regressor @ pushed))
        error = target - float(regressor @ self.estimates)
        self.estimates = self.estimates + gain * error
        updated = (self.gain - np.outer(gain, pushed)) / kept
        self.gain = 0.5 * (updated + updated.T)
        outer = np.outer(regressor, regressor)
        self._moments = kept * self._moments + h * outer
        self._weight = kept * self._weight + h
        self._note_score(regressor * (target - float(regressor @ self.estimates)), kept)
        self.steps += 1

    def _note_score(self, score: Array, kept: float) -> None:
        self._block = kept * self._block + self._step_s * score
        self._meat = kept * kept * self._meat
        self._in_block += 1
        if self._in_block == self._block_steps:
            self._meat = self._meat + np.outer(self._block, self._block)
            self._block = np.zeros_like(self._block)
            self._in_block = 0

    @property
    def deviations(self) -> Array:
        """Return the standard errors of the estimates; infinite while there are too few data."""
        blocks = self.steps // self._block_steps
        free = blocks - len(self.estimates)
        if free < 1:
            return np.full(len(self.estimates), math.inf)
        # Few blocks flatter themselves: the estimate was fitted to the very errors they sum.
        covariance = self.gain @ self._meat @ self.gain * (blocks / free)
        return np.asarray(np.sqrt(np.maximum(np.diag(covariance), 0.0)))

    @property
    def condition(self) -> float:
        """Return the persistent-excitation measure: how far the regressors differ, 0 to 1.

        It is the smallest eigenvalue of their correlation matrix over the data still remembered; 0
        when a regressor is missing or follows from the others.
        """
        levels = self.levels
        if self._weight == 0.0 or np.any(levels <= 0.0):
            return 0.0
        correlation = self._moments / self._weight / np.outer(levels, levels)
        return float(max(0.0, np.linalg.eigvalsh(correlation)[0]))

    @property
    def levels(self) -> Array:
        """Return the root mean square of every regressor over the data still remembered."""
        if self._weight == 0.0:
            return np.zeros(len(self.estimates))
        return np.asarray(np.sqrt(np.diag(self._moments) / self._weight))

    def warnings(self, names: tuple[str, ...]) -> list[str]:
        """Return what is wrong with the estimates, named; empty when the data support them."""
        found = []
        condition = self.condition
        if condition < CONDITION_MIN:
            levels = ", ".join(
                f"{name} {level:.2g}" for name, level in zip(names, self.levels, strict=True)
            )
            found.append(
                f"the data are not exciting enough to tell the parameters apart (measure "
                f"{condition:.1e}, at least {CONDITION_MIN:g} is needed; root mean square of the "
                f"regressor of each: {levels}); move the input more, or longer"
            )
        for name, value, deviation in zip(names, self.estimates, self.deviations, strict=True):
            if not math.isfinite(deviation):
                found.append(f"{name}: too short a record to say how sure the estimate is")
            elif deviation > UNCERTAINTY_MAX * abs(value):
                found.append(
                    f"{name} = {value:.4g} is uncertain: its standard error is {deviation:.2g}"
                )
        return found
