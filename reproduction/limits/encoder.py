"""The limit that the encoder sets, beside that of the line."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import solve_continuous_are

from reproduction.limits.models import integrators
from tenbaud.bounds.closed import DOUBLE_INTEGRATOR
from tenbaud.bounds.floor import floor
from tenbaud.bounds.linear import LinearModel


def encoder_floor(counts_per_turn: int) -> float:
    """Return the rms of rounding to a count, in rad: its width over the root of 12."""
    if counts_per_turn < 1:
        raise ValueError(f"counts_per_turn is {counts_per_turn}; it must be at least 1")
    return math.tau / counts_per_turn / math.sqrt(12.0)


def double_integrator_rate_at_encoder_floor(density: float, counts_per_turn: int) -> float:
    """Return the bit/s at which an ideal code's error is as small as the encoder's rounding.

    For an angle under white torque: (0.890 q / (width^2 / 12))^(1/3).
    """
    width_squared = encoder_floor(counts_per_turn) ** 2
    return float((DOUBLE_INTEGRATOR * density / width_squared) ** (1.0 / 3.0))


def floor_behind_encoder(
    density: float, rate_bit_s: float, counts_per_turn: int, tick_s: float
) -> float:
    """Return the mean square floor, in rad^2, of an angle under white torque that an encoder reads."""
    step = math.tau / counts_per_turn
    return floor_behind_encoders(integrators(2, density), [[1.0, 0.0]], step, tick_s, rate_bit_s)


def floor_behind_encoders(
    model: LinearModel, outputs: ArrayLike, steps: ArrayLike, tick_s: float, rate_bit_s: float
) -> float:
    """Return the least mean square error where encoders of these steps read the outputs at every tick.

    An encoder's rounding is taken for white noise of `step^2 / 12` at every tick. Who forms the bits
    then knows the Kalman filter's estimate and no more; the error is the filter's own, plus the floor
    of what the estimate does, which is the same plant driven by the innovations, `L r L'` (separation
    of estimation and coding: Wolf and Ziv, IEEE Trans. Inf. Theory 16, 1970). Rounding is not white
    noise; this is a yardstick, not a bound.
    """
    if not tick_s > 0.0:
        raise ValueError(f"tick_s is {tick_s}; it must be above 0")
    C = np.atleast_2d(np.asarray(outputs, dtype=float))
    seen = np.diag(np.broadcast_to(np.asarray(steps, dtype=float), (len(C),)) ** 2 / 12.0 * tick_s)
    own = solve_continuous_are(model.dynamics.T, C.T, model.noise, seen)
    gain = own @ C.T @ np.linalg.inv(seen)
    driven = LinearModel(model.dynamics, gain @ seen @ gain.T, model.cost)
    return float(np.sum(model.cost * own)) + floor(driven, rate_bit_s)
