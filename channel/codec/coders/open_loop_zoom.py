"""One-bit coders whose range ignores the signs: a fixed range, and time-based zooming.

The word is that of the paper's coder, a sign per axis (20), and so is the correction (21)-(23). Only
the range differs. It follows the clock alone:

    M_{k+1} = (1 - rho) M_min + rho M_k

which with rho = 1 stays at M_0: the fixed range. Such a coder can fall asleep: once the range is down,
an error that has grown beyond what the small range corrects is never caught up. It is here to show
what the adaptive rule (19) is for.
"""

from __future__ import annotations

from typing import NamedTuple

from channel.codec.codec import STATE_MAX, Vector
from channel.codec.coders.base import CoderFunctions, Numbers, Results, Symbols
from channel.codec.coders.signs import Gains, SignCoder, encode_signs, spread_signs


class OpenLoopZoomParameters(NamedTuple):
    """Constants of the range and the observer gains."""

    initial_range: float = 0.5
    """M_0, in the unit of the measurement (rad)"""
    minimum_range: float = 0.05
    """M_min, where the range ends"""
    decay: float = 0.95
    """rho, in (0, 1]; 1 keeps the range as it is"""
    gains: Gains = ((4.1,), (8.6,))
    """a row per corrected model state, a column per measured axis"""
    impulse: bool = False


def open_loop_zoom_decode(
    constants: OpenLoopZoomParameters,
    coder: Numbers,
    model: Numbers,
    symbols: Symbols,
    erased: bool,
    correction: Results,
    after: Results,
) -> None:
    """Write the correction (21),(23) and the ranges of the next sample."""
    spread_signs(constants.gains, coder, symbols, correction)
    for axis in range(len(symbols)):
        floor = (1.0 - constants.decay) * constants.minimum_range
        after[axis] = floor + constants.decay * coder[axis]


class OpenLoopZoomCoder(SignCoder):
    """A sign per axis, and ranges that shrink by the clock. Coder state: the ranges."""

    functions = CoderFunctions(encode_signs, open_loop_zoom_decode)
    parameters: OpenLoopZoomParameters

    def __init__(self, parameters: OpenLoopZoomParameters) -> None:
        super().__init__(parameters)

    def initial(self) -> Vector:
        return (self.parameters.initial_range,) * self.axes

    def is_state(self, coder: Vector) -> bool:
        return all(0.0 <= value < STATE_MAX for value in coder)
