"""The paper's coder (16)-(22): one sign per measured axis, scaled by an adaptive range.

The word of sample `k` is `sigma_k = sign(y - y_hat)` per axis, `sign(0) = +1`. Both ends take the
error for `M_k sigma_k` and correct the observer by `gains * M_k sigma_k`. The mean `lambda_k` of
the last `window` signs tells whether the coder is saturated (19):

    M_{k+1} = (1 - rho) M_min + (rho M_k  if |lambda_k| <= 0.5  else  M_k / rho)

An erased word corrects nothing and enters the window as a zero.
"""

from __future__ import annotations

from typing import NamedTuple

from channel.codec.codec import STATE_MAX, Vector
from channel.codec.coders.base import CoderFunctions, Numbers, Results, Symbols
from channel.codec.coders.signs import Gains, SignCoder, encode_signs, spread_signs


class ZoomParameters(NamedTuple):
    """Constants of (19) and the observer gains. Defaults are the paper's."""

    initial_range: float = 0.5
    """M_0, in the unit of the measurement (rad)"""
    minimum_range: float = 0.05
    """M_min"""
    decay: float = 0.95
    """rho, in (0, 1]"""
    window: int = 2
    """number of signs in the mean `lambda_k`; the paper's (19) has two"""
    gains: Gains = ((4.1,), (8.6,))
    """a row per corrected model state, a column per measured axis: l1 and l2 of (23)"""
    impulse: bool = False
    """False: the correction is held over the sample as in (22); True: applied to the state at once"""


def zoom_decode(
    constants: ZoomParameters,
    coder: Numbers,
    model: Numbers,
    symbols: Symbols,
    erased: bool,
    correction: Results,
    after: Results,
) -> None:
    """Write the correction (21),(23) and the coder state after (19)."""
    spread_signs(constants.gains, coder, symbols, correction)
    axes = len(symbols)
    older = constants.window - 1
    for axis in range(axes):
        start = axes + axis * older
        total = 0.0 + symbols[axis]
        for place in range(start, start + older):
            total += coder[place]
        for place in range(start + older - 1, start, -1):
            after[place] = coder[place - 1]
        if older > 0:
            after[start] = 0.0 + symbols[axis]
        # |lambda| <= 0.5 without a division: the signs are small whole numbers, so this is exact.
        saturated = 2.0 * total > constants.window or 2.0 * total < -constants.window
        decay = constants.decay
        scaled = coder[axis] / decay if saturated else decay * coder[axis]
        after[axis] = (1.0 - decay) * constants.minimum_range + scaled


class ZoomCoder(SignCoder):
    """One sign and one self-adjusting range per measured axis.

    Coder state: the ranges of all axes, then the last `window - 1` signs of each axis, newest first.
    """

    functions = CoderFunctions(encode_signs, zoom_decode)
    parameters: ZoomParameters

    def __init__(self, parameters: ZoomParameters) -> None:
        super().__init__(parameters)
        if parameters.window < 1:
            raise ValueError(f"window must be at least 1 sign, got {parameters.window}")

    def initial(self) -> Vector:
        """Return `M_0` for every axis and an empty (zero) sign history."""
        history = self.axes * (self.parameters.window - 1)
        return (self.parameters.initial_range,) * self.axes + (0.0,) * history

    def is_state(self, coder: Vector) -> bool:
        """Return whether these are ranges, and signs or the zeros of erased words."""
        ranges = all(0.0 <= value < STATE_MAX for value in coder[: self.axes])
        return ranges and all(value in (-1.0, 0.0, 1.0) for value in coder[self.axes :])
