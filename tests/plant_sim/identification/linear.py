"""The paper's algorithm (5)-(10) for any plant of one input and one output, from the product's parts.

    y^(n) + a_1 y^(n-1) + ... + a_n y = b_0 u^(m) + ... + b_m u                      (5)
    y^(n) = phi' Omega,   Omega = [-a_1, ..., -a_n, b_0, ..., b_m]                   (6)

Both signals pass through equal state filters (7); their states are the regressors.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from plant_sim.identification.estimator import Array, Estimator
from plant_sim.identification.state_filter import StateFilter


class LinearEstimates(NamedTuple):
    """Coefficients of (5)."""

    denominator: tuple[float, ...]
    """a_1 ... a_n"""
    numerator: tuple[float, ...]
    """b_0 ... b_m"""


class LinearIdentifier:
    """On-line: one pair (u, y) in, estimates out.

    `order` is n, `input_order` is m (0 ... n - 1); `polynomial` is D(p), Hurwitz, of degree n.
    Regressors count from `settle_s` on, when what the plant did before the first sample has died out
    of the filters; 0 for a plant that starts at rest.
    """

    def __init__(
        self,
        order: int,
        input_order: int,
        polynomial: Sequence[float],
        step_s: float,
        *,
        settle_s: float = 0.0,
        forgetting_per_s: float = 0.01,
        gain: float = 1e3,
        gain_bound: float | None = None,
        block_s: float = 6.0,
    ) -> None:
        self._filter = StateFilter(polynomial, step_s, count=2)
        self.order = order
        self.input_order = input_order
        self.estimator = Estimator(
            order + input_order + 1,
            step_s,
            forgetting_per_s=forgetting_per_s,
            gain=gain,
            gain_bound=gain_bound,
            block_s=block_s,
        )
        self._settle_steps = round(settle_s / step_s)
        self._taken = 0

    @property
    def names(self) -> tuple[str, ...]:
        """Return the names of the coefficients, in the order of the estimator."""
        a = [f"a_{index}" for index in range(1, self.order + 1)]
        return (*a, *(f"b_{index}" for index in range(self.input_order + 1)))

    def take(self, u: float, y: float) -> LinearEstimates:
        """Take the next sample and return the estimates after it."""
        states = self._filter
        states.take(np.array((y, u), dtype=np.float64))
        self._taken += 1
        if self._taken > self._settle_steps:
            outputs = states.states[::-1, 0]
            inputs = states.states[self.input_order :: -1, 1]
            self.estimator.update(np.concatenate((outputs, inputs)), float(states.highest[0]))
        return self.estimates

    @property
    def estimates(self) -> LinearEstimates:
        """Return the coefficients as estimated so far."""
        values: Array = self.estimator.estimates
        return LinearEstimates(
            tuple(float(-value) for value in values[: self.order]),
            tuple(float(value) for value in values[self.order :]),
        )

    def warnings(self) -> list[str]:
        """Return what is wrong with the estimates; empty when the data support them."""
        return self.estimator.warnings(self.names)
