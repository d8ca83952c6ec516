"""The sine of `channel.numerics` without branches, for many flights side by side."""

from __future__ import annotations

import math

import numpy as np

from channel.numerics import (
    _EIGHTH_TURN,
    _QUARTER_HIGH,
    _QUARTER_LOW,
    _QUARTER_MIDDLE,
    _QUARTER_TURNS_PER_RAD,
    ANGLE_RAD_MAX,
    _cos_reduced,
    _sin_reduced,
)


def lane_sine(x: float) -> float:
    """Return what `channel.numerics.sin` returns, to the last bit; not a number where that refuses.

    Both series are computed and one is taken, which a processor does for several angles at once. The
    count of quarter turns stays a float: it is a whole number below 2**16, so all about it is exact.
    """
    rounded = np.floor(0.5 + abs(x) * _QUARTER_TURNS_PER_RAD)
    quarters = 0.0 if abs(x) <= _EIGHTH_TURN else math.copysign(rounded, x)
    high = x - quarters * _QUARTER_HIGH
    middle = quarters * _QUARTER_MIDDLE
    r = high - middle
    tail = ((high - r) - middle) - quarters * _QUARTER_LOW
    quadrant = quarters - 4.0 * np.floor(0.25 * quarters)
    sine = _sin_reduced(r, tail)
    cosine = _cos_reduced(r, tail)
    size = cosine if quadrant == 1.0 or quadrant == 3.0 else sine
    value = -size if quadrant >= 2.0 else size
    return value if abs(x) <= ANGLE_RAD_MAX else math.nan
