"""Where the encoder, not the line, limits what is known."""

from __future__ import annotations

import math

from tenbaud.limits.closed import DOUBLE_INTEGRATOR
from tenbaud.limits.floor import rate_for
from tenbaud.limits.linear import LinearModel


def encoder_floor(counts_per_turn: int) -> float:
    """Return the rms of rounding to a count, in rad: its width over the root of 12."""
    if counts_per_turn < 1:
        raise ValueError(f"counts_per_turn is {counts_per_turn}; it must be at least 1")
    return math.tau / counts_per_turn / math.sqrt(12.0)


def rate_at_encoder_floor(model: LinearModel, counts_per_turn: int) -> float:
    """Return the bit/s at which an ideal code's error is as small as the encoder's rounding."""
    return rate_for(model, encoder_floor(counts_per_turn) ** 2)


def double_integrator_rate_at_encoder_floor(density: float, counts_per_turn: int) -> float:
    """Return the same for an angle under white torque: (0.890 q / (width^2 / 12))^(1/3)."""
    width_squared = encoder_floor(counts_per_turn) ** 2
    return float((DOUBLE_INTEGRATOR * density / width_squared) ** (1.0 / 3.0))
