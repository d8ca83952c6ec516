"""Sine, cosine and exponential in integer arithmetic, as the reference for the bounds.

Numbers are integers counting units of 2**-400. Nothing here shares a method or a constant with
``channel.codec.numerics``: pi comes from Machin's formula, the rest from plain Taylor series, and the
platform's mathematics library takes no part.
"""

from __future__ import annotations

from fractions import Fraction

BITS = 400
ONE = 1 << BITS


def _arctangent_of_inverse(n: int) -> int:
    term = ONE // n
    total = 0
    k = 0
    while term:
        total += term // (2 * k + 1) if k % 2 == 0 else -(term // (2 * k + 1))
        term //= n * n
        k += 1
    return total


PI = 4 * (4 * _arctangent_of_inverse(5) - _arctangent_of_inverse(239))


def _fixed(x: float) -> int:
    """Exact for every float that is a multiple of 2**-400."""
    value = Fraction(x) * ONE
    if value.denominator != 1:
        raise ValueError(f"{x!r} has digits below 2**-{BITS}")
    return value.numerator


def _series(term: int, first: int, step: int, ratio: int) -> int:
    """Sum ``term`` and its successors, each ``ratio / (step successive integers)`` of the last."""
    total = 0
    n = first
    while term not in (0, -1):  # a right shift of a negative number ends at -1
        total += term
        for k in range(step):
            term //= n + k + 1
        term = (term * ratio) >> BITS
        n += step
    return total


def sine(x: float) -> Fraction:
    """Return sin(x), right to about 2**-380."""
    angle = _fixed(x) % (2 * PI)
    return Fraction(_series(angle, 1, 2, -((angle * angle) >> BITS)), ONE)


def cosine(x: float) -> Fraction:
    """Return cos(x), right to about 2**-380."""
    angle = _fixed(x) % (2 * PI)
    return Fraction(_series(ONE, 0, 2, -((angle * angle) >> BITS)), ONE)


def exponential(x: float) -> Fraction:
    """Return e**x, right to a relative 2**-380 or so: a 1024th part is summed, then squared."""
    value = _series(ONE, 0, 1, _fixed(x) // 1024)
    result = Fraction(value, ONE)
    for _ in range(10):
        result = result * result
        # Keep 400 significant bits, or the fractions double in length at every square.
        size = result.numerator.bit_length() - result.denominator.bit_length()
        shift = BITS - size
        unit = Fraction(1 << shift) if shift >= 0 else Fraction(1, 1 << -shift)
        result = Fraction(round(result * unit)) / unit
    return result
