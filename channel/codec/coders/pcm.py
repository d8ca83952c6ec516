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
from typing import NamedTuple

from channel.codec.codec import STATE_MAX, Vector
from channel.codec.coders.base import (
    CoderFunctions,
    FunctionCoder,
    Numbers,
    Results,
    SymbolResults,
    Symbols,
)
from channel.codec.coders.static import number_of, write_bits
from channel.codec.words import Alphabet


@dataclass(frozen=True, slots=True)
class PcmParameters:
    """Constants of the words and of the differentiator."""

    bits: int = 10
    """b, symbols in a word"""
    range: float = 3.141592653589793
    """half the width that the words cover, in the unit of the measurement (rad)"""
    period_s: float = 0.01
    """T, time between two words"""
    rate_filter_s: float = 0.0
    """tau"""


class PcmConstants(NamedTuple):
    """Constants of the functions below."""

    half: int
    """number of the word for the angle zero"""
    step: float
    """between two neighbouring words"""
    period_s: float
    rate_filter_s: float


def pcm_encode(
    constants: PcmConstants,
    coder: Numbers,
    predicted: Numbers,
    measurement: Numbers,
    symbols: SymbolResults,
) -> None:
    """Write the nearest step of the angle; beyond the range, the outermost one."""
    step = math.floor(measurement[0] / constants.step + 0.5)
    write_bits(step + constants.half, symbols)


def pcm_decode(
    constants: PcmConstants,
    coder: Numbers,
    model: Numbers,
    symbols: Symbols,
    erased: bool,
    correction: Results,
    after: Results,
) -> None:
    """Write what brings (angle, rate) to the word and its difference; nothing if erased."""
    last, age = coder[0], coder[1]
    if erased:
        correction[0] = correction[1] = 0.0
        after[0] = last
        after[1] = age + 1.0 if age > 0.0 else 0.0
        return
    angle = (number_of(symbols) - constants.half) * constants.step
    turn = 0.0
    if age > 0.0:
        elapsed = age * constants.period_s
        share = elapsed / (elapsed + constants.rate_filter_s)
        turn = share * ((angle - last) / elapsed - model[1])
    correction[0] = angle - model[0]
    correction[1] = turn
    after[0] = angle
    after[1] = 1.0


class PcmCoder(FunctionCoder):
    """`b` binary symbols per word. Coder state: the last angle and how many samples ago it was.

    An age of 0 says that there is none yet.
    """

    functions = CoderFunctions(pcm_encode, pcm_decode)
    impulse = True
    correction_size = 2

    def __init__(self, parameters: PcmParameters) -> None:
        if not 1 <= parameters.bits <= 15:
            raise ValueError(f"bits must be 1 ... 15, got {parameters.bits}")
        if not (parameters.range > 0.0 and parameters.period_s > 0.0):
            raise ValueError("range and period_s must be above 0")
        if not parameters.rate_filter_s >= 0.0:
            raise ValueError(f"rate_filter_s must be at least 0, got {parameters.rate_filter_s}")
        self.parameters = parameters
        self.alphabet = Alphabet((0, 1), parameters.bits)
        half = 1 << (parameters.bits - 1)
        self.constants = PcmConstants(
            half, parameters.range / half, parameters.period_s, parameters.rate_filter_s
        )

    def initial(self) -> Vector:
        """Return that no angle has come yet."""
        return (0.0, 0.0)

    def is_state(self, coder: Vector) -> bool:
        """Return whether this is an angle within the words' range and a count of samples."""
        last, age = coder
        within = -self.parameters.range <= last <= self.parameters.range
        return within and 0.0 <= age < STATE_MAX and age == math.floor(age)

    def ranges(self, coder: Vector) -> Vector:
        """Return half a step, the largest error of an angle within the range."""
        return (0.5 * self.constants.step,)
