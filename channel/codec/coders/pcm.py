"""The usual coder, for comparison: every sample's angle as a word, and the rate by differences.

A word of `b` bits is the encoder's angle rounded to one of `2^b` steps of a turn. The receiver takes
it as it is, and the difference of two words over the time between them for the rate, if wished
through a first-order low-pass:

    rate <- rate + T / (T + tau) ((y_k - y_{k-1}) / T - rate),   tau = 0: the plain difference

Several angles have their words in turn, one a sample: a fixed frame. It belongs to the `hold` model,
whose angles and rates are set by the words.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from channel.codec.codec import STATE_MAX, Alphabet, Vector
from channel.codec.coders.base import (
    CoderFunctions,
    FunctionCoder,
    Numbers,
    Results,
    SymbolResults,
    Symbols,
)
from channel.codec.coders.static import number_of, write_bits


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
    angles: int = 1


class PcmConstants(NamedTuple):
    """Constants of the functions below."""

    half: int
    """number of the word for the angle zero"""
    step: float
    """between two neighbouring words"""
    period_s: float
    rate_filter_s: float
    angles: int


def turn_of(constants: PcmConstants, coder: Numbers) -> int:
    """Return the angle that a sample's word codes."""
    return math.floor(coder[2 * constants.angles]) if constants.angles > 1 else 0


def pcm_encode(
    constants: PcmConstants,
    coder: Numbers,
    predicted: Numbers,
    measurement: Numbers,
    symbols: SymbolResults,
) -> None:
    """Write the nearest step of the angle; beyond the range, the outermost one."""
    step = math.floor(measurement[turn_of(constants, coder)] / constants.step + 0.5)
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
    """Write the correction of (angle, rate) to the word and its difference; nothing if erased."""
    angles, turn = constants.angles, turn_of(constants, coder)
    for place in range(angles):
        age = coder[angles + place]
        correction[place] = correction[angles + place] = 0.0
        after[place] = coder[place]
        after[angles + place] = age + 1.0 if age > 0.0 else 0.0
    if angles > 1:
        after[2 * angles] = turn + 1.0 if turn + 1 < angles else 0.0
    if erased:
        return
    last, age = coder[turn], coder[angles + turn]
    angle = (number_of(symbols) - constants.half) * constants.step
    change = 0.0
    if age > 0.0:
        elapsed = age * constants.period_s
        share = elapsed / (elapsed + constants.rate_filter_s)
        change = share * ((angle - last) / elapsed - model[angles + turn])
    correction[turn] = angle - model[turn]
    correction[angles + turn] = change
    after[turn] = angle
    after[angles + turn] = 1.0


class PcmCoder(FunctionCoder):
    """`b` binary symbols per word. Coder state: each last angle, and how many samples ago it was.

    An age of 0 says that there is none yet. Of several angles the one whose turn it is comes last.
    """

    functions = CoderFunctions(pcm_encode, pcm_decode)
    impulse = True

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
            half,
            parameters.range / half,
            parameters.period_s,
            parameters.rate_filter_s,
            parameters.angles,
        )
        self.correction_size = 2 * parameters.angles

    def initial(self) -> Vector:
        """Return that no angle has come yet."""
        angles = self.parameters.angles
        return (0.0,) * (2 * angles + (angles > 1))

    def is_state(self, coder: Vector) -> bool:
        """Return whether these are angles within the words' range, counts of samples, and a turn."""
        angles = self.constants.angles
        most = self.parameters.range
        return all(-most <= last <= most for last in coder[:angles]) and all(
            0.0 <= count < limit and count == math.floor(count)
            for counts, limit in (
                (coder[angles : 2 * angles], STATE_MAX),
                (coder[2 * angles :], angles),
            )
            for count in counts
        )

    def about(self, coder: Vector, word: Sequence[int], correction: Numbers) -> tuple[int, ...]:
        """Return the angle whose turn it is, for every symbol."""
        return (turn_of(self.constants, coder),) * len(word)

    def ranges(self, coder: Vector) -> Vector:
        """Return half a step, the largest error of an angle within the range."""
        return (0.5 * self.constants.step,) * self.parameters.angles
