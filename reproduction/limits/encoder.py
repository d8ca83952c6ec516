"""The limit that the encoder sets, beside that of the line."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from tenbaud.bounds.closed import DOUBLE_INTEGRATOR
from tenbaud.bounds.floor import floor
from tenbaud.design.plant import LinearPlant, behind_encoders, linear_plant


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
    integrator = linear_plant([[0.0, 1.0], [0.0, 0.0]], [[0.0], [1.0]], [[1.0, 0.0]], None, density)
    return floor_behind_encoders(integrator, [math.tau / counts_per_turn], tick_s, rate_bit_s)


def floor_behind_encoders(
    plant: LinearPlant, steps: Sequence[float], tick_s: float, rate_bit_s: float
) -> float:
    """Return the least mean square error where encoders of these steps read the outputs at every tick.

    It is the estimation error of the transmitter, plus the floor for coding its estimate (separation of
    estimation and coding: Wolf and Ziv, IEEE Trans. Inf. Theory 16, 1970). Rounding is not white noise;
    this is a yardstick, not a bound.
    """
    seen, own = behind_encoders(plant, steps, tick_s)
    driven = seen.model()
    return float(np.sum(driven.cost * own)) + floor(driven, rate_bit_s)
