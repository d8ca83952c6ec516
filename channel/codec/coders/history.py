"""One bit per sample, formed with a look-ahead and decoded with the bits before it.

The word is a sign again. Two things make it better than the paper's coder:

* **Reading.** The meaning of a sign depends on the signs before it. After `+-` the error is small,
  after `+++` it is large and going on. A table, one row for each pattern of the last signs relative to
  the present one, holds how far angle and rate are corrected and how the range `M` is multiplied:

      correction = sigma M (a[i], b[i] / T),      M <- g[i] M  within  M_min ... M_max

  Rows for a run of equal signs let the range grow, those for alternating ones let it shrink: the range
  follows disturbances of any strength, and both ends follow it by the symbols alone. Where disturbances
  come in periods, `M_min` may follow the range slowly (the mean of its logarithm):

      S <- S + g ln(M / (M0 e^S)),                M_min = M0 e^(c S)

  with ln x taken as 2 (x - 1) / (x + 1), which is close to it between 1/4 and 4 and bounds a step.
* **Forming.** The transmitter knows angle *and rate* (from its full-rate encoder), the state of the
  copy it shares with the receiver, and so everything the receiver will make of either sign. It
  sends the one that leaves the least squared angle error over the next samples, taking its own best
  answers to them into account, with no more disturbance assumed:

      min over signs of  sum over samples of integral e^2 dt / T  +  w_aa e^2 + 2 w_ar e r + w_rr r^2

  where `e` is the angle error at a sample and `r` the rate error times T.

With one row, no look-ahead and a constant range this is the sign test on a predicted combination of
angle and rate, which is what a sign-of-innovation Kalman filter comes to in steady state.

An erased word corrects nothing and leaves range and history as they are.
"""

from __future__ import annotations

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
from channel.codec.numerics import exp

Row = tuple[float, float, float]

MEMORY_MAX = 10
LOOKAHEAD_MAX = 6
"""Samples; the work doubles with each."""
THIRD = 1.0 / 3.0
SLOW_MAX = 100.0
"""of S; the ratio of any two ranges is far below exp(100)"""


@dataclass(frozen=True, slots=True)
class HistoryParameters:
    """Constants of the coder; angles in rad."""

    rows: tuple[Row, ...]
    """(a, b, g) of each pattern. Bit j of a row's number is 1 when the sign j + 1 samples ago was the
    present one; `2^(n-1)` rows for patterns of n signs"""
    initial_range: float
    minimum_range: float
    maximum_range: float
    period_s: float
    """T"""
    weights: tuple[float, float, float] = (1.0, 1.0, 1.0)
    """w_aa, w_ar, w_rr of the error that is left after the look-ahead"""
    lookahead: int = 1
    """samples that are looked ahead"""
    floor_gain: float = 0.0
    """g; 0: the smallest range is constant and S is no part of the state"""
    floor_exponent: float = 0.0
    """c"""


class HistoryConstants(NamedTuple):
    """Constants of the functions below."""

    angle: Vector
    rate: Vector
    """of the rate error times T"""
    growth: Vector
    smallest: float
    largest: float
    period_s: float
    weights: tuple[float, float, float]
    lookahead: int
    floor_gain: float
    floor_exponent: float


def floor_of(constants: HistoryConstants, coder: Numbers) -> float:
    """Return M_min."""
    if len(coder) < 3:
        return constants.smallest
    return constants.smallest * exp(constants.floor_exponent * coder[2])


def least_cost(
    constants: HistoryConstants,
    angle: float,
    rate: float,
    reach: float,
    smallest: float,
    history: int,
    samples: int,
) -> float:
    """Return the least cost of an error over `samples` samples, when the best signs are sent.

    `angle` is the angle error before the first sign (rad), `rate` the rate error times T,
    `reach` the range, `smallest` its minimum and `history` the signs before.
    """
    if samples == 0:
        weights = constants.weights
        return weights[0] * angle * angle + 2.0 * weights[1] * angle * rate + weights[2] * rate * rate
    last = len(constants.angle) - 1
    # +1
    a = angle - reach * constants.angle[history]
    s = rate - reach * constants.rate[history]
    r = reach * constants.growth[history]
    r = smallest if r < smallest else r
    r = constants.largest if r > constants.largest else r
    cost = a * a + a * s + THIRD * s * s
    cost += least_cost(constants, a + s, s, r, smallest, 2 * history + 1 & last, samples - 1)
    # -1
    row = last - history
    a = angle + reach * constants.angle[row]
    s = rate + reach * constants.rate[row]
    here = a * a + a * s + THIRD * s * s
    if here < cost:
        r = reach * constants.growth[row]
        r = smallest if r < smallest else r
        r = constants.largest if r > constants.largest else r
        here += least_cost(constants, a + s, s, r, smallest, 2 * history & last, samples - 1)
        if here < cost:
            return here
    return cost


def history_encode(
    constants: HistoryConstants,
    coder: Numbers,
    predicted: Numbers,
    measurement: Numbers,
    symbols: SymbolResults,
) -> None:
    """Write the sign that leaves least error; both vectors are (angle, rate)."""
    reach = coder[0]
    history = int(coder[1])
    smallest = floor_of(constants, coder)
    angle = measurement[0] - predicted[0]
    rate = (measurement[1] - predicted[1]) * constants.period_s
    best = 0.0
    for sign in (1, -1):
        row = history if sign > 0 else len(constants.angle) - 1 - history
        a = angle - sign * reach * constants.angle[row]
        s = rate - sign * reach * constants.rate[row]
        cost = least_cost(constants, a, s, reach, smallest, history, 0)
        if constants.lookahead > 0:
            after, following = history_after(constants, reach, smallest, history, sign)
            cost = a * a + a * s + THIRD * s * s
            ahead = constants.lookahead - 1
            cost += least_cost(constants, a + s, s, after, smallest, following, ahead)
        if sign > 0 or cost < best:
            best = cost
            symbols[0] = sign


def history_after(
    constants: HistoryConstants, reach: float, smallest: float, history: int, sign: int
) -> tuple[float, int]:
    """Return range and history after a sign."""
    last = len(constants.angle) - 1
    grown = reach * constants.growth[history if sign > 0 else last - history]
    grown = smallest if grown < smallest else grown
    grown = constants.largest if grown > constants.largest else grown
    return grown, 2 * history + (1 if sign > 0 else 0) & last


def history_decode(
    constants: HistoryConstants,
    coder: Numbers,
    model: Numbers,
    symbols: Symbols,
    erased: bool,
    correction: Results,
    after: Results,
) -> None:
    """Write the correction of (angle, rate) and the coder state after it."""
    reach = coder[0]
    history = int(coder[1])
    if erased:
        correction[0] = 0.0
        correction[1] = 0.0
        after[0] = reach
        after[1] = coder[1]
        if len(after) > 2:
            after[2] = coder[2]
        return
    sign = symbols[0]
    row = history if sign > 0 else len(constants.angle) - 1 - history
    correction[0] = sign * reach * constants.angle[row]
    correction[1] = sign * reach * constants.rate[row] / constants.period_s
    smallest = floor_of(constants, coder)
    grown, following = history_after(constants, reach, smallest, history, sign)
    after[0] = grown
    after[1] = 1.0 * following
    if len(after) > 2:
        mean = constants.smallest * exp(coder[2])
        after[2] = coder[2] + constants.floor_gain * (2.0 * (grown - mean) / (grown + mean))


class HistoryCoder(FunctionCoder):
    """One sign per sample for one axis.

    Coder state: the range, the last signs as a number, and S where the floor follows the range.
    """

    functions = CoderFunctions(history_encode, history_decode)
    impulse = True
    uses_rates = True
    correction_size = 2
    alphabet = Alphabet((-1, 1), 1)

    def __init__(self, parameters: HistoryParameters) -> None:
        check(parameters)
        self.parameters = parameters
        self.constants = HistoryConstants(
            tuple(row[0] for row in parameters.rows),
            tuple(row[1] for row in parameters.rows),
            tuple(row[2] for row in parameters.rows),
            parameters.minimum_range,
            parameters.maximum_range,
            parameters.period_s,
            parameters.weights,
            parameters.lookahead,
            parameters.floor_gain,
            parameters.floor_exponent,
        )

    def initial(self) -> Vector:
        """Return the first range, and a history of alternating signs."""
        slow = (0.0,) if self.parameters.floor_gain > 0.0 else ()
        history = float(0b0101010101 & len(self.parameters.rows) - 1)
        return (self.parameters.initial_range, history, *slow)

    def is_state(self, coder: Vector) -> bool:
        """Return whether this is a range within its limits, and a history that has a row."""
        reach, history, *slow = coder
        known = history in range(len(self.parameters.rows)) and all(-1e-9 < s < SLOW_MAX for s in slow)
        return self.parameters.minimum_range <= reach <= self.parameters.maximum_range and known

    def ranges(self, coder: Vector) -> Vector:
        return coder[:1]


def check(parameters: HistoryParameters) -> None:
    """Raise ValueError where the parameters make no coder."""
    rows = len(parameters.rows)
    if rows < 1 or rows & rows - 1 or rows > 1 << MEMORY_MAX - 1:
        raise ValueError(
            f"rows are one for each pattern of signs: 1, 2, 4 ... {1 << MEMORY_MAX - 1} of them, "
            f"got {rows}"
        )
    for number, (angle, rate, growth) in enumerate(parameters.rows):
        if not (angle > 0.0 and rate > 0.0 and growth > 0.0):
            raise ValueError(f"row {number} is {(angle, rate, growth)}; its three must be above 0")
    smallest, largest = parameters.minimum_range, parameters.maximum_range
    if not 0.0 < smallest <= parameters.initial_range <= largest:
        raise ValueError(
            "ranges must be 0 < minimum <= initial <= maximum, got "
            f"{smallest}, {parameters.initial_range}, {largest}"
        )
    if not parameters.period_s > 0.0:
        raise ValueError(f"period_s is {parameters.period_s}; it must be above 0")
    if not 0 <= parameters.lookahead <= LOOKAHEAD_MAX:
        raise ValueError(f"lookahead must be 0 ... {LOOKAHEAD_MAX}, got {parameters.lookahead}")
    for name in ("floor_gain", "floor_exponent"):
        if not 0.0 <= getattr(parameters, name) <= 1.0:
            raise ValueError(f"{name} must be 0 ... 1, got {getattr(parameters, name)}")
    angle, cross, rate = parameters.weights
    if not (angle > 0.0 and rate > 0.0 and angle * rate >= cross * cross):
        raise ValueError(f"weights must make a cost that is never negative, got {parameters.weights}")
