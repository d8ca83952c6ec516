"""A coder as somebody else may write it, in functions of numbers; and one in methods."""

from __future__ import annotations

from typing import Any, NamedTuple

from channel.codec.codec import Alphabet, CoderContext, Vector, Word
from channel.codec.coders.base import CoderFunctions, FunctionCoder


class Constants(NamedTuple):
    growth: float
    gains: tuple[float, float]


def thirds_encode(
    constants: Constants, coder: Any, predicted: Any, measurement: Any, symbols: Any
) -> None:
    """Write whether the error is low, small or high."""
    error = measurement[0] - predicted[0]
    symbols[0] = 1
    if error < -coder[0]:
        symbols[0] = 0
    elif error > coder[0]:
        symbols[0] = 2


def thirds_decode(
    constants: Constants,
    coder: Any,
    model: Any,
    symbols: Any,
    erased: bool,
    correction: Any,
    after: Any,
) -> None:
    step = 0 if erased else symbols[0] - 1
    for row in range(len(constants.gains)):
        correction[row] = constants.gains[row] * (coder[0] * step)
    width = coder[0] / constants.growth if step == 0 else coder[0] * constants.growth
    after[0] = 0.02 if width < 0.02 else width


class Thirds(FunctionCoder):
    functions = CoderFunctions(thirds_encode, thirds_decode)
    alphabet = Alphabet((0, 1, 2), 1)
    impulse = True
    correction_size = 2

    def __init__(self, context: CoderContext) -> None:
        self.constants = Constants(1.5, (1.0, 2.0))

    def initial(self) -> Vector:
        return (0.3,)

    def ranges(self, coder: Vector) -> Vector:
        return coder


class Methods:
    """A coder that only Python can run."""

    alphabet = Alphabet((-1, 1), 1)
    impulse = True
    uses_rates = False

    def __init__(self, context: CoderContext) -> None:
        pass

    def initial(self) -> Vector:
        return (0.3,)

    def encode(self, coder: Vector, predicted: Vector, measurement: Vector) -> tuple[int, ...]:
        return (1,) if measurement >= predicted else (-1,)

    def decode(self, coder: Vector, state: Vector, word: Word) -> tuple[Vector, Vector]:
        return (0.0, 0.0), coder

    def ranges(self, coder: Vector) -> Vector:
        return coder
