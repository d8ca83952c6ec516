"""The memoryless coder (16): the measurement itself in a few bits, independent of earlier words.

A uniform quantiser of `2^b` cells over `-range ... +range` says in which cell the measurement lies;
both ends take the middle of the cell for the measurement and correct the observer by
`gains * (middle - predicted)`. With b = 1 the middles are +-range/2, which is (16) with M = range/2:
the sign of the angle, and nothing about the error.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from channel.codec.codec import Alphabet, Vector
from channel.codec.coders.base import (
    CoderFunctions,
    FunctionCoder,
    Numbers,
    Results,
    SymbolResults,
    Symbols,
)
from channel.codec.coders.signs import Gains, axes_of


@dataclass(frozen=True, slots=True)
class StaticParameters:
    """Constants of the quantiser and the observer gains."""

    bits: int = 1
    """b, symbols in a word"""
    range: float = 3.141592653589793
    """half the width that the cells cover, in the unit of the measurement (rad)"""
    gains: Gains = ((4.1,), (8.6,))
    """a row per corrected model state, one column: one measured axis"""
    impulse: bool = False


class StaticConstants(NamedTuple):
    """Constants of the functions below."""

    range: float
    width: float
    """of a cell"""
    gains: Gains


def static_encode(
    constants: StaticConstants,
    coder: Numbers,
    predicted: Numbers,
    measurement: Numbers,
    symbols: SymbolResults,
) -> None:
    """Write the number of the measurement's cell; beyond the range, of the outermost one."""
    cell = math.floor((measurement[0] + constants.range) / constants.width)
    write_bits(cell, symbols)


def static_decode(
    constants: StaticConstants,
    coder: Numbers,
    model: Numbers,
    symbols: Symbols,
    erased: bool,
    correction: Results,
    after: Results,
) -> None:
    """Write the correction towards the middle of the cell; none for an erasure."""
    error = 0.0
    if not erased:
        middle = (number_of(symbols) + 0.5) * constants.width - constants.range
        error = middle - model[0]
    for row in range(len(constants.gains)):
        correction[row] = 0.0 + constants.gains[row][0] * error


class StaticCoder(FunctionCoder):
    """`b` binary symbols per word, the most significant first. It has no state."""

    functions = CoderFunctions(static_encode, static_decode)

    def __init__(self, parameters: StaticParameters) -> None:
        if axes_of(parameters.gains) != 1:
            raise ValueError("the static coder takes one measured axis, so one column of gains")
        if not 1 <= parameters.bits <= 15:
            raise ValueError(f"bits must be 1 ... 15, got {parameters.bits}")
        if not parameters.range > 0.0:
            raise ValueError(f"range must be above 0, got {parameters.range}")
        self.parameters = parameters
        self.impulse = parameters.impulse
        self.alphabet = Alphabet((0, 1), parameters.bits)
        self.correction_size = len(parameters.gains)
        width = 2.0 * parameters.range / (1 << parameters.bits)
        self.constants = StaticConstants(parameters.range, width, parameters.gains)

    def ranges(self, coder: Vector) -> Vector:
        """Return half the width of a cell, the largest error of a measurement within the range."""
        return (0.5 * self.constants.width,)


def write_bits(number: int, symbols: SymbolResults) -> None:
    """Write a whole number as binary symbols, clamped to their range."""
    bits = len(symbols)
    largest = (1 << bits) - 1
    clamped = 0 if number < 0 else largest if number > largest else number
    for index in range(bits):
        symbols[index] = clamped >> (bits - 1 - index) & 1


def number_of(word: Symbols) -> int:
    """Return the whole number that binary symbols stand for."""
    number = 0
    for index in range(len(word)):
        number = 2 * number + word[index]
    return number
