"""The memoryless coder (16): the measurement itself in a few bits, whatever was sent before.

A uniform quantiser of `2^b` cells over `-range ... +range` says in which cell the measurement lies;
both ends take the middle of the cell for the measurement and correct the observer by
`gains * (middle - predicted)`. With b = 1 the middles are +-range/2, which is (16) with M = range/2:
the sign of the angle, and nothing about the error.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from channel.codec import Vector
from channel.coders.signs import Gains, axes_of, spread
from channel.words import ERASED, Alphabet, Word


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


class StaticCoder:
    """`b` binary symbols per word, the most significant first. It has no state."""

    uses_rates = False

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
        self._cells = 1 << parameters.bits
        self._width = 2.0 * parameters.range / self._cells

    def initial(self) -> Vector:
        """Return nothing: this coder remembers nothing."""
        return ()

    def encode(self, coder: Vector, predicted: Vector, measurement: Vector) -> tuple[int, ...]:
        """Return the number of the measurement's cell; beyond the range, of the outermost one."""
        cell = math.floor((measurement[0] + self.parameters.range) / self._width)
        return bits_of(cell, self.parameters.bits)

    def decode(self, coder: Vector, state: Vector, word: Word) -> tuple[Vector, Vector]:
        """Return the correction towards the middle of the cell; none for an erasure."""
        if word is ERASED:
            return (0.0,) * len(self.parameters.gains), ()
        middle = (number_of(word) + 0.5) * self._width - self.parameters.range
        return spread((middle - state[0],), self.parameters.gains), ()

    def ranges(self, coder: Vector) -> Vector:
        """Return half the width of a cell, the largest error of a measurement within the range."""
        return (0.5 * self._width,)


def bits_of(number: int, bits: int) -> tuple[int, ...]:
    """Return a whole number in `bits` binary symbols, clamped to what they can say."""
    largest = (1 << bits) - 1
    clamped = 0 if number < 0 else largest if number > largest else number
    return tuple(clamped >> place & 1 for place in range(bits - 1, -1, -1))


def number_of(word: tuple[int, ...]) -> int:
    """Return the whole number that binary symbols stand for."""
    number = 0
    for symbol in word:
        number = 2 * number + symbol
    return number
