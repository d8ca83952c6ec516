"""The largest likelihood: scores by differences, steps by their outer product."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from plant_sim.identification.filters import Array
from plant_sim.zero_order_hold import differences

Function = Callable[[Array], tuple[Array, Array]]
"""point -> log-likelihood of each sample, and what belongs to it"""
ROUNDS = 80
TRIES = 12
NUDGE = 0.1
"""of a difference, in standard deviations as far as they are known"""
GAIN_LEAST = 1e-3
"""of the log-likelihood in a round; below it the climb ends"""


@dataclass(frozen=True, slots=True, eq=False)
class Maximum:
    """Where a climb ended."""

    point: Array
    log: float
    scores: Array
    """derivatives of each sample's log-likelihood"""
    means: Array
    converged: bool

    @property
    def information(self) -> Array:
        """Return the sum of the scores' outer products."""
        return np.asarray(self.scores.T @ self.scores)


def climb(function: Function, start: Array, scale: Array) -> Maximum:
    """Return the maximum above a start.

    A step is that of Berndt, Hall, Hall and Hausman, damped where it does not lead up; no parameter
    moves by more than its `scale` at once.
    """
    point, nudge, damping, converged = start.copy(), 1e-3 * scale, 1e-2, False
    logs, means = function(point)
    for _ in range(ROUNDS):
        scores = _scores(function, point, nudge)
        information, slope = scores.T @ scores, scores.sum(axis=0)
        diagonal = np.maximum(np.diag(information), 1e-12 / scale**2)
        nudge = np.minimum(NUDGE / np.sqrt(diagonal), NUDGE * scale)
        gain = 0.0
        for _ in range(TRIES):
            step = np.linalg.solve(information + np.diag(damping * diagonal), slope)
            tried = point + np.clip(step, -scale, scale)
            found, others = function(tried)
            gain = float(found.sum() - logs.sum())
            if math.isfinite(gain) and gain > 0.0:
                point, logs, means, damping = tried, found, others, max(0.2 * damping, 1e-4)
                break
            gain, damping = 0.0, 5.0 * damping
        if gain < GAIN_LEAST:
            converged = True
            break
    return Maximum(point, float(logs.sum()), _scores(function, point, nudge), means, converged)


def _scores(function: Function, point: Array, nudge: Array) -> Array:
    return differences(lambda moved: function(moved)[0], point, nudge)
