"""A linear plant for designs, and its floors: the figures of `tenbaud floor`.

dx/dt = A x + B u + G w,     y = C x,     E w(t) w(t')' = diag(q) delta(t - t')
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy
from numpy.typing import ArrayLike

from tenbaud.bounds.floor import floor_covariance, word_floor
from tenbaud.bounds.linear import LinearModel, Matrix, linear_model, rate_needed, reached


@dataclass(frozen=True, slots=True)
class LinearPlant:
    """A, B, C, the disturbance's G and q, and the weight of each output's squared error."""

    A: Matrix
    B: Matrix
    C: Matrix
    G: Matrix
    densities: Matrix
    """q, two-sided, one for each column of G"""
    weights: Matrix

    @property
    def noise(self) -> Matrix:
        """Return G diag(q) G'."""
        return self.G * self.densities @ self.G.T

    def model(self) -> LinearModel:
        """Return the model of the floors; ValueError if there is none."""
        return linear_model(self.A, self.noise, self.C, self.weights)


def linear_plant(
    A: ArrayLike,
    B: ArrayLike,
    C: ArrayLike,
    G: ArrayLike | None = None,
    densities: ArrayLike = 1.0,
    weights: ArrayLike | None = None,
) -> LinearPlant:
    """Return a plant; the disturbance acts like the commands unless G says otherwise.

    One density serves all columns of G, as one weight does all outputs.
    """
    a, b, c = (np.atleast_2d(np.asarray(one, dtype=float)) for one in (A, B, C))
    g = b if G is None else np.atleast_2d(np.asarray(G, dtype=float))
    for name, matrix, shape in (
        ("A", a, (len(a), len(a))),
        ("B", b, (len(a), b.shape[1])),
        ("C", c, (len(c), len(a))),
        ("G", g, (len(a), g.shape[1])),
    ):
        if matrix.shape != shape or not np.isfinite(matrix).all():
            raise ValueError(f"{name} must be {shape[0]} x {shape[1]} finite numbers, got {matrix}")
    q = np.broadcast_to(np.asarray(densities, dtype=float), (g.shape[1],)).copy()
    w = np.broadcast_to(np.asarray(1.0 if weights is None else weights, dtype=float), (len(c),)).copy()
    return LinearPlant(a, b, c, g, q, w)


def behind_encoders(
    plant: LinearPlant, steps: Sequence[float], tick_s: float
) -> tuple[LinearPlant, Matrix]:
    """Return what its Kalman filter shows of a plant, as a plant, and the covariance of its errors.

    Encoders of these steps read the outputs at every tick, and their rounding is taken for white noise
    of `step^2 / 12` at every tick. Who forms the bits knows the filter's estimate and no more: it is
    the same plant driven by the innovations, `L r L'`.
    """
    if not tick_s > 0.0:
        raise ValueError(f"tick_s is {tick_s}; it must be above 0")
    outputs = len(plant.C)
    seen: Matrix = np.full(outputs, steps, dtype=np.float64) ** 2 / 12.0 * tick_s
    found = scipy.linalg.solve_continuous_are(plant.A.T, plant.C.T, plant.noise, np.diag(seen))
    own: Matrix = np.asarray(found, dtype=np.float64)
    return replace(plant, G=own @ plant.C.T / seen, densities=seen), own


@dataclass(frozen=True, slots=True)
class Floors:
    """The least errors at a rate; none where it is too low for the plant."""

    rate_bit_s: float
    rate_needed_bit_s: float
    """more than this is needed by the data-rate theorem"""
    rms: tuple[float, ...] | None
    """per output, together the least by their weights, for bits that flow all the time"""
    weighted_rms: float | None
    """root of the weighted sum of their squares"""
    words_over_flow: float | None
    """by how much that root is larger when the bits come one word per symbol period"""


def floors(plant: LinearPlant, rate_bit_s: float, symbol_period_s: float | None = None) -> Floors:
    """Return the floors of a plant at a rate; with a symbol period, those of its words too.

    States that no disturbance reaches are known to both ends from the commands. ValueError where the
    outputs do not show all that is disturbed.
    """
    needed = rate_needed(plant.A)
    if not rate_bit_s > needed:
        return Floors(rate_bit_s, needed, None, None, None)
    model, basis = reached(plant.A, plant.noise, plant.C, plant.weights)
    covariance = floor_covariance(model, rate_bit_s)
    seen = plant.C @ basis
    squares = np.einsum("ij,jk,ik->i", seen, covariance, seen)
    least = float(plant.weights @ squares)
    over = None
    if symbol_period_s is not None:
        words = word_floor(model, rate_bit_s * symbol_period_s, symbol_period_s)
        over = math.sqrt(words / least)
    rms = tuple(float(value) for value in np.sqrt(squares))
    return Floors(rate_bit_s, needed, rms, math.sqrt(least), over)


def rows_of(matrix: Matrix) -> tuple[tuple[float, ...], ...]:
    """Return a matrix as a configuration and the codec hold it."""
    return tuple(tuple(float(value) for value in row) for row in matrix)
