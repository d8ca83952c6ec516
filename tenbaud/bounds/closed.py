"""The floors that have a closed form; see `floor.py` for what a floor is, and for any linear model.

The Wiener process has `q / (2 R ln 2)` (Gorbunov and Pinsker 1974), the double integrator, which is an
angle under white torque, `(8/27) q / (R ln 2)^3`. The restoring torque of the pitch changes little as
long as bits come much faster than it oscillates, 10 a second against one cycle in six.
"""

from __future__ import annotations

import math

LN2 = math.log(2.0)
WIENER = 1.0 / (2.0 * LN2)
"""0.721: mean square error of the Wiener process times R/q"""
DOUBLE_INTEGRATOR = 8.0 / 27.0 / LN2**3
"""0.890: that of the double integrator times R^3/q"""


def double_integrator_floor(density: float, rate_bit_s: float) -> float:
    """Return that of an angle under white torque, (8/27) q / (R ln 2)^3, in rad^2."""
    return DOUBLE_INTEGRATOR * density / rate_bit_s**3


def double_integrator_rate(density: float, mean_square: float) -> float:
    """Return the bit/s that an ideal code needs for a mean square error (rad^2); the floor inverted."""
    return float((DOUBLE_INTEGRATOR * density / mean_square) ** (1.0 / 3.0))
