"""Sine, cosine and exponential whose bits do not depend on the machine.

Both ends of the link advance one codec each and compare digests, so a single last bit of
difference breaks lockstep. Library functions cannot be trusted with that. Measured on one machine,
one interpreter, by masking processor features: glibc's ``sin`` and ``cos`` change 0.07 % of their
results without FMA and ``exp`` 0.06 %; against musl, ``sin`` and ``cos`` change 3 %; numpy's
``exp`` changes 4.6 % with AVX-512 masked; even ``x**2`` differs from ``x*x`` now and then. On an
unstable plant such a bit doubles with every ``ln 2 / growth rate`` and nothing on the link pulls
it back.

Rules of this file (a test reads the syntax tree and holds them):

* only ``+ - * /``, comparison, integers and ``math.floor`` on Python floats. Every one of these
  is rounded once to binary64 by its own byte code, so no compiler can fuse or reorder them;
* plain floats and integers, ``if`` and ``while``: the studies compile these very functions;
* a changed bit is a changed wire format: both ends must be updated together, and the golden
  vectors in ``tests/golden/numerics.json`` with them.

Bounds (error of the result against the exact value; tests measure them in rational arithmetic):

=============  ======================  ======================================  ==========
function       domain                  error stated                            measured
=============  ======================  ======================================  ==========
``sin, cos``   ``|x| <= 100000`` rad   1.25e-16 absolute                       1.11e-16
``sin, cos``   the same                2**-52 = 2.2e-16 relative, zeros too    1.57e-16
``exp``        ``|x| <= 700``          2**-52 = 2.2e-16 relative               1.4e-16
=============  ======================  ======================================  ==========

The result is not always the nearest float, and need not be: it only has to be the same float
everywhere. Zeros are positive: ``sin(-0.0)`` is ``0.0``, so that a digest never sees a sign that
means nothing. For every other ``x``, ``sin(-x) == -sin(x)`` and ``cos(-x) == cos(x)``.
"""

from __future__ import annotations

import math
from typing import NoReturn

ANGLE_RAD_MAX = 100000.0
"""Largest angle accepted: it keeps the count of quarter turns below 2**16."""
EXPONENT_MAX = 700.0
"""Largest exponent accepted: every result and every power of two on the way is a normal float."""

_EIGHTH_TURN = 0.7853981633974483  # pi/4
_ONE_QUARTER_MAX = 2.35
"""Below this, and above an eighth of a turn, one quarter turn is nearest (3 pi/4 is 2.356)."""
_QUARTER_TURNS_PER_RAD = 0.6366197723675814  # 2/pi
# pi/2 = HIGH + MIDDLE + LOW + 5e-40. HIGH and MIDDLE have 37 significant bits, so that their
# product with a count below 2**16 is exact (53 bits).
_QUARTER_HIGH = 1.5707963267923333
_QUARTER_MIDDLE = 2.5633441515839558e-12
_QUARTER_LOW = 1.0562999066987428e-23

_OCTAVES_PER_UNIT = 1.4426950408889634  # 1/ln 2
# ln 2 = HIGH + LOW + 2e-31. HIGH has 42 bits: times a count up to 1010 (10 bits) it is exact.
_LN2_HIGH = 0.6931471805598903
_LN2_LOW = 5.497923018708371e-14

# Polynomials that bring the largest error on the reduced interval to its minimum (Remez exchange
# in 60 digits, then rounded to floats). They fit, with z = r*r:
#   sin r = r + r*z*S(z)          |r| <= pi/4     relative error 2**-57.9
#   cos r = 1 - z/2 + z*z*C(z)    |r| <= pi/4     absolute error 2**-64.2
#   exp r = 1 + r + r*r*E(r)      |r| <= ln(2)/2  relative error 2**-57.9
_S0 = -0.1666666666666663
_S1 = 0.008333333333322108
_S2 = -0.00019841269829580174
_S3 = 2.755731361802039e-06
_S4 = -2.5050747218679084e-08
_S5 = 1.5896197663986506e-10

_C0 = 0.0416666666666666
_C1 = -0.0013888888888874125
_C2 = 2.48015872894822e-05
_C3 = -2.7557314352336624e-07
_C4 = 2.0875723273695147e-09
_C5 = -1.135964782546109e-11

_E0 = 0.5000000000000011
_E1 = 0.16666666666666413
_E2 = 0.04166666666653016
_E3 = 0.008333333333494461
_E4 = 0.0013888888943629789
_E5 = 0.0001984126950658019
_E6 = 2.4801493099268864e-05
_E7 = 2.755758637280255e-06
_E8 = 2.763024824421549e-07
_E9 = 2.500006183517555e-08


def sin(x: float) -> float:
    """Return the sine of ``x`` radians; ``|x| <= ANGLE_RAD_MAX``, otherwise ``ValueError``."""
    # Most angles of a flight are within 3 eighths of a turn: these two ranges are written out, which
    # in plain Python halves the time. They do what the general way below does, to the last bit.
    if -_EIGHTH_TURN <= x <= _EIGHTH_TURN:
        z = x * x
        series = _S0 + z * (_S1 + z * (_S2 + z * (_S3 + z * (_S4 + z * _S5))))
        return x + (x * z * series + 0.0)
    size = x if x > 0.0 else -x
    if size < _ONE_QUARTER_MAX:
        high = size - _QUARTER_HIGH
        r = high - _QUARTER_MIDDLE
        tail = ((high - r) - _QUARTER_MIDDLE) - _QUARTER_LOW
        z = r * r
        series = _C0 + z * (_C1 + z * (_C2 + z * (_C3 + z * (_C4 + z * _C5))))
        value = 1.0 - (0.5 * z - (z * z * series - r * tail))
        return value if x > 0.0 else -value
    if not (-ANGLE_RAD_MAX <= x <= ANGLE_RAD_MAX):  # written so that a NaN is refused too
        refuse("sin takes angles from -100000 to 100000 rad", x)
    quarters, remainder, tail = _reduce_angle(x)
    quadrant = quarters & 3
    if quadrant == 0:
        return _sin_reduced(remainder, tail)
    if quadrant == 1:
        return _cos_reduced(remainder, tail)
    if quadrant == 2:
        return -_sin_reduced(remainder, tail)
    return -_cos_reduced(remainder, tail)


def cos(x: float) -> float:
    """Return the cosine of ``x`` radians; ``|x| <= ANGLE_RAD_MAX``, otherwise ``ValueError``."""
    if -_EIGHTH_TURN <= x <= _EIGHTH_TURN:
        return _cos_reduced(x, 0.0)
    if not (-ANGLE_RAD_MAX <= x <= ANGLE_RAD_MAX):
        refuse("cos takes angles from -100000 to 100000 rad", x)
    quarters, remainder, tail = _reduce_angle(x)
    quadrant = quarters & 3
    if quadrant == 0:
        return _cos_reduced(remainder, tail)
    if quadrant == 1:
        return -_sin_reduced(remainder, tail)
    if quadrant == 2:
        return -_cos_reduced(remainder, tail)
    return _sin_reduced(remainder, tail)


def exp(x: float) -> float:
    """Return e to the power ``x``; ``|x| <= EXPONENT_MAX``, otherwise ``ValueError``."""
    if not (-EXPONENT_MAX <= x <= EXPONENT_MAX):
        refuse("exp takes exponents from -700 to 700", x)
    octaves = math.floor(x * _OCTAVES_PER_UNIT + 0.5)
    high = x - octaves * _LN2_HIGH  # exact
    low = octaves * _LN2_LOW
    r = high - low
    tail = (high - r) - low  # what rounding r has lost
    polynomial = _E5 + r * (_E6 + r * (_E7 + r * (_E8 + r * _E9)))
    polynomial = _E0 + r * (_E1 + r * (_E2 + r * (_E3 + r * (_E4 + r * polynomial))))
    return (1.0 + (r + (tail + r * r * polynomial))) * _power_of_two(octaves)


def refuse(what: str, x: float) -> NoReturn:
    """Raise ValueError for a number out of range; in compiled studies its text lacks the number."""
    raise ValueError(f"{what}, got {x}")


def _reduce_angle(x: float) -> tuple[int, float, float]:
    """Return (n, r, tail) with ``x = n*pi/2 + r + tail`` and ``|r| <= pi/4``, n nearest.

    Three pieces of pi/2 keep ``r + tail`` right to about 2**-110, which is what the relative
    bound needs: a float below the limit comes as close as 2**-60 to a multiple of pi/2.
    """
    # Rounded on the absolute value, so that the result is odd in x to the last bit.
    if x < 0.0:
        quarters = -math.floor(0.5 - x * _QUARTER_TURNS_PER_RAD)
    else:
        quarters = math.floor(0.5 + x * _QUARTER_TURNS_PER_RAD)
    high = x - quarters * _QUARTER_HIGH  # exact
    middle = quarters * _QUARTER_MIDDLE  # exact
    r = high - middle
    tail = ((high - r) - middle) - quarters * _QUARTER_LOW
    return quarters, r, tail


def _sin_reduced(r: float, tail: float) -> float:
    """Return sin(r + tail) for ``|r| <= pi/4`` and a tail below one rounding of ``r``."""
    z = r * r
    series = _S0 + z * (_S1 + z * (_S2 + z * (_S3 + z * (_S4 + z * _S5))))
    return r + (r * z * series + tail)


def _cos_reduced(r: float, tail: float) -> float:
    """Return cos(r + tail) for ``|r| <= pi/4`` and a tail below one rounding of ``r``."""
    z = r * r
    series = _C0 + z * (_C1 + z * (_C2 + z * (_C3 + z * (_C4 + z * _C5))))
    return 1.0 - (0.5 * z - (z * z * series - r * tail))


def _power_of_two(exponent: int) -> float:
    """Return 2.0 to an exponent from -1010 to 1010, by products that are all exact."""
    factor = 2.0
    remaining = exponent
    if exponent < 0:
        factor = 0.5
        remaining = -exponent
    result = 1.0
    while remaining > 0:
        if remaining & 1:
            result = result * factor
        remaining = remaining >> 1
        if remaining > 0:  # the square after the last bit would leave the range of normal floats
            factor = factor * factor
    return result
