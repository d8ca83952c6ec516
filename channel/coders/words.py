"""The usual way, to compare with: every sample's angle as a word, and the rate by differences.

A word of `b` bits is the encoder's angle rounded to one of `2^b` steps of a turn. The receiver takes
it as it is, and the difference of two words over the time between them for the rate, if wished
through a first-order low-pass:

    rate <- rate + T / (T + tau) ((y_k - y_{k-1}) / T - rate),   tau = 0: the plain difference

It belongs to the `hold` model, whose two states are set by it at every word.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from channel.codec import Vector
from channel.coders.static import bits_of, number_of
from channel.words import ERASED, Alphabet, Word


@dataclass(frozen=True, slots=True)
class WordsParameters:
    """Constants of the words and of the differentiator."""

    bits: int = 10
    """b, symbols in a word"""
    range: float = 3.141592653589793
    """half the width that the words cover, in the unit of the measurement (rad)"""
    period_s: float = 0.01
    """T, time between two words"""
    rate_filter_s: float = 0.0
    """tau"""


class WordsCoder:
    """`b` binary symbols per word. Coder state: the last angle and how many samples ago it was.

    An age of 0 says that there is none yet.
    """

    impulse = True
    uses_rates = False

    def __init__(self, parameters: WordsParameters) -> None:
        if not 1 <= parameters.bits <= 15:
            raise ValueError(f"bits must be 1 ... 15, got {parameters.bits}")
        if not (parameters.range > 0.0 and parameters.period_s > 0.0):
            raise ValueError("range and period_s must be above 0")
        if not parameters.rate_filter_s >= 0.0:
            raise ValueError(f"rate_filter_s must be at least 0, got {parameters.rate_filter_s}")
        self.parameters = parameters
        self.alphabet = Alphabet((0, 1), parameters.bits)
        self._half = 1 << (parameters.bits - 1)
        self._step = parameters.range / self._half

    def initial(self) -> Vector:
        """Return that no angle has come yet."""
        return (0.0, 0.0)

    def encode(self, coder: Vector, predicted: Vector, measurement: Vector) -> tuple[int, ...]:
        """Return the nearest step of the angle; beyond the range, the outermost one."""
        step = math.floor(measurement[0] / self._step + 0.5)
        return bits_of(step + self._half, self.parameters.bits)

    def decode(self, coder: Vector, state: Vector, word: Word) -> tuple[Vector, Vector]:
        """Return what brings (angle, rate) to the word and its difference; nothing if erased."""
        last, age = coder
        if word is ERASED:
            return (0.0, 0.0), (last, age + 1.0 if age > 0.0 else 0.0)
        angle = (number_of(word) - self._half) * self._step
        turn = 0.0
        if age > 0.0:
            elapsed = age * self.parameters.period_s
            share = elapsed / (elapsed + self.parameters.rate_filter_s)
            turn = share * ((angle - last) / elapsed - state[1])
        return (angle - state[0], turn), (angle, 1.0)

    def ranges(self, coder: Vector) -> Vector:
        """Return half a step, the largest error of an angle within the range."""
        return (0.5 * self._step,)
