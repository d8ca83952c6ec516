"""Residuals with their derivatives by finite differences, for `scipy.optimize.least_squares`."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from plant_sim.identification.filters import Array

STEP = float(np.sqrt(np.finfo(np.float64).eps))
"""of a parameter, relative to itself or 1, as scipy's own differences have it"""


class Differences:
    """Residuals of parameters, and their derivatives.

    `residuals_of` returns the residuals of several sets of parameters, each one array of one dimension.
    It is called once for a set and its neighbours: a step of the optimisation is mostly taken, and then
    the derivatives there are the next question.
    """

    def __init__(self, residuals_of: Callable[[list[Array]], list[Array]]) -> None:
        self._residuals_of = residuals_of
        self._at: Array | None = None
        self._jacobian: Array | None = None

    def __call__(self, values: Array) -> Array:
        """Return the residuals at `values`."""
        steps = STEP * np.where(values >= 0.0, 1.0, -1.0) * np.maximum(1.0, np.abs(values))
        neighbours = values + np.diag(steps)
        here, *there = self._residuals_of([values, *neighbours])
        moved = (neighbours - values).diagonal()
        self._at = values.copy()
        self._jacobian = np.stack(
            [(one - here) / step for one, step in zip(there, moved, strict=True)], axis=1
        )
        return here

    def jacobian(self, values: Array) -> Array:
        """Return the derivatives at `values`: (residuals, parameters)."""
        if self._at is None or not np.array_equal(values, self._at):
            self(values)
        assert self._jacobian is not None
        return self._jacobian
