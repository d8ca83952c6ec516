"""The worst case: disturbances that are bounded by one, and nothing else is known of them.

    x_{k+1} = a x_k + w_k,   |w_k| <= 1,   one of `cells` messages per step, heard T steps later

The largest error of the best code is exactly

    sum_{i=1..T} |a|^(i-1)  +  |a|^T / (cells - |a|)

(Nakahira, Matni and Doyle, "Hard limits on robust control over delayed and quantized communication
channels", CDC 2015). For `a = 1` and one bit: T + 1, so that a step of delay costs as much as the whole
quantiser. Fractions go in and come out, so that equality is equality.
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction


def worst_case_error(growth: Fraction, cells: int, delay_steps: int) -> Fraction:
    """Return the largest error that no code can avoid and one reaches; `cells` is 2^R."""
    size = abs(growth)
    if cells <= size:
        raise ValueError(
            f"{cells} messages per step cannot hold a plant that grows by {float(size):g}: the "
            f"data-rate theorem asks for more than {float(size):g} messages"
        )
    if delay_steps < 0:
        raise ValueError(f"delay_steps is {delay_steps}; it must be at least 0")
    waiting = sum((size**step for step in range(delay_steps)), Fraction(0))
    return waiting + size**delay_steps / (cells - size)


def cell_widths(growth: Fraction, cells: int, start: Fraction) -> Iterator[Fraction]:
    """Yield the half-width of what the receiver knows after each message, from a known start.

    A uniform quantiser splits the interval in `cells`, the plant stretches it and the disturbance adds
    one on each side: `h <- (|a| h + 1) / cells`. Its limit is `1 / (cells - |a|)`.
    """
    half = start
    while True:
        yield half
        half = (abs(growth) * half + 1) / cells
