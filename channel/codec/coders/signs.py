"""Common parts of the one-bit coders: a sign per measured axis, and gains for the states."""

from __future__ import annotations

from typing import Any

from channel.codec.codec import Alphabet, Vector
from channel.codec.coders.base import FunctionCoder, Numbers, Results, SymbolResults, Symbols

Gains = tuple[tuple[float, ...], ...]


def axes_of(gains: Gains) -> int:
    """Return the number of measured axes, one column each; ValueError for rows that do not match."""
    axes = len(gains[0]) if gains else 0
    if axes < 1 or any(len(row) != axes for row in gains):
        raise ValueError(f"gains need rows of equal, non-zero length, got {gains}")
    return axes


def encode_signs(
    constants: Any, coder: Numbers, predicted: Numbers, measurement: Numbers, symbols: SymbolResults
) -> None:
    """Write the sign of the estimation error of each axis (20); the sign of zero is +1."""
    for axis in range(len(symbols)):
        symbols[axis] = 1 if measurement[axis] >= predicted[axis] else -1


def spread_signs(gains: Gains, ranges: Numbers, signs: Symbols, correction: Results) -> None:
    """Write the correction of each model state: its row of gains times `M sigma` of each axis (21)."""
    for row in range(len(gains)):
        total = 0.0
        for axis in range(len(signs)):
            total += gains[row][axis] * (ranges[axis] * signs[axis])
        correction[row] = total


class SignCoder(FunctionCoder):
    """A sign per measured axis, and a range for each, which come first in the coder state.

    The functions take the parameters as they are: `gains`, `decay`, `impulse` and others.
    """

    def __init__(self, parameters: Any) -> None:
        self.axes = axes_of(parameters.gains)
        if not 0.0 < parameters.decay <= 1.0:
            raise ValueError(f"decay must be in (0, 1], got {parameters.decay}")
        self.parameters = self.constants = parameters
        self.impulse = parameters.impulse
        self.alphabet = Alphabet((-1, 1), self.axes)
        self.correction_size = len(parameters.gains)

    def ranges(self, coder: Vector) -> Vector:
        return coder[: self.axes]
