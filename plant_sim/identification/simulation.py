"""A second estimate: the parameters whose simulation fits the record best.

The record is cut into segments. Each is simulated under the recorded inputs, from the initial state
that fits its outputs best, and the difference to the recorded outputs is minimised by
`scipy.optimize.least_squares`. It shares nothing with the regression (9), (10) but the data and the
structure, so that an error in either method shows as a disagreement.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from plant_sim.identification.differences import Differences
from plant_sim.identification.errors import IdentificationError
from plant_sim.identification.filters import Array
from plant_sim.identification.segments import Segments
from plant_sim.identification.structures import Structure, names_of
from plant_sim.identification.trajectories import Candidate, simulation_residuals

DRAWS_MIN = 12


@dataclass(frozen=True, slots=True, eq=False)
class SimulationFit:
    """The simulation-error fit."""

    values: dict[str, float]
    covariance: Array
    lag_s: float
    lag_deviation_s: float
    """0 where it was given"""
    residuals: Array
    """root mean square of each output's simulation error"""
    explained: float
    """share of the motion within the segments, beyond their own beginnings, that is simulated"""


def fit(
    segments: Segments,
    structure: Structure,
    start: Mapping[str, float],
    lag_s: float,
    *,
    estimate_lag: bool = False,
) -> SimulationFit:
    """Fit a structure to the segments, beginning at the values `start` and the lag `lag_s`."""
    names = names_of(structure)
    guess = np.array([start[name] for name in names] + [lag_s] * estimate_lag)
    scale = segments.scale

    def candidate(values: Array) -> Candidate:
        lag = float(abs(values[-1])) if estimate_lag else lag_s
        return Candidate(dict(zip(names, values.tolist(), strict=False)), lag, segments)

    def residuals_of(sets: list[Array]) -> list[Array]:
        found = simulation_residuals(structure, [candidate(values) for values in sets])
        return [(one / scale).ravel() for one in found]

    size = np.maximum(np.abs(guess), 0.05)
    if estimate_lag:
        size[-1] = max(lag_s, segments.step_s)
    if not np.all(np.isfinite(guess)):
        raise IdentificationError("the regression gave no numbers to begin the simulation with")
    residuals = Differences(residuals_of)
    solution = least_squares(residuals, guess, residuals.jacobian, x_scale=size, max_nfev=30)
    jacobian: Array = np.asarray(solution.jac, dtype=np.float64)
    covariance = _covariance(jacobian, solution.fun, segments)
    errors = solution.fun.reshape(segments.outputs.shape) * scale
    (still,) = simulation_residuals(structure, [Candidate(dict.fromkeys(names, 0.0), 0.0, segments)])
    moved = float(np.mean((still / scale) ** 2))
    values = solution.x.tolist()
    return SimulationFit(
        dict(zip(names, values, strict=False)),
        covariance[: len(names), : len(names)],
        abs(values[-1]) if estimate_lag else lag_s,
        math.sqrt(max(0.0, covariance[-1, -1])) if estimate_lag else 0.0,
        np.sqrt(np.mean(errors**2, axis=(0, 1))),
        1.0 - float(np.mean(solution.fun**2)) / moved if moved else 0.0,
    )


def _covariance(jacobian: Array, errors: Array, segments: Segments) -> Array:
    """Return the parameters' covariance, the errors of each stretch being one draw.

    A stretch is a segment, or a part of one where the segments are too few.
    """
    samples, count, outputs = segments.outputs.shape
    size = jacobian.shape[1]
    parts = min(samples, math.ceil(max(DRAWS_MIN, 3 * size) / count))
    edges = np.arange(parts) * samples // parts
    bread = np.linalg.pinv(jacobian.T @ jacobian)
    scores = (jacobian * errors[:, None]).reshape(samples, count, outputs, size).sum(axis=2)
    draws = np.add.reduceat(scores, edges, axis=0).reshape(-1, size)
    return np.asarray(bread @ (draws.T @ draws) @ bread * (len(draws) / max(1, len(draws) - size)))
