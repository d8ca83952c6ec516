"""Laws from estimate to command, as functions of numbers: the PID loops (24), feedback of all states.

Both keep to the codec's arithmetic, so that either end can run them: the receiver's controllers as
they stand, studies compiled, and with a *mirrored* law (`channel.codec.downlink`) both ends, for it is
part of the state machine that they share.
"""

from __future__ import annotations

from collections.abc import MutableSequence, Sequence
from math import isfinite
from typing import NamedTuple

Vector = tuple[float, ...]
Rows = tuple[Vector, ...]


class PidConstants(NamedTuple):
    """Constants of one loop, for the functions below."""

    proportional: float
    integral_per_tick: float
    derivative: float
    mixing: Vector
    """how much of the loop's sum each input gets"""
    conditional: bool
    """whether the integral rests while more of it would change neither input nor set-point"""
    steers: int = -1
    """number of the later loop whose set-point the sum moves; -1: it goes to the inputs"""
    share: float = 0.0
    """of the sum, in that set-point"""
    most: float = 0.0
    """of that set-point, either way"""


def pid_sum(constants: PidConstants, integral: float, error: float, rate: float) -> float:
    """Return u of (24)."""
    return constants.proportional * error + integral - constants.derivative * rate


def pid_integral(constants: PidConstants, integral: float, error: float, stuck: bool) -> float:
    """Return the integral term of the next tick; `stuck`: more of it would change nothing."""
    if constants.conditional and stuck:
        return integral
    return integral + constants.integral_per_tick * error


def is_stuck(value: float, push: float, largest: float) -> bool:
    """Return whether an input, or a set-point, of this value would not change if pushed further.

    A loop's integral rests when all that it moves is. One saturated input is not enough: with a large
    bias one always is, the others still steer, and an integral frozen there would leave an error.
    """
    return push == 0.0 or (value >= largest if push > 0.0 else value <= -largest)


def pid_command(
    loops: Sequence[PidConstants],
    integrals: MutableSequence[float],
    errors: MutableSequence[float],
    rates: Sequence[float],
    limits: Sequence[float],
    wanted: MutableSequence[float],
) -> bool:
    """Add all loops to `wanted`, step their integrals, and clamp; False where a sum is not finite.

    A loop that steers another one adds to that one's error instead.

    Sessions run it as it stands, and studies compile it.
    """
    for place in range(len(loops)):
        constants = loops[place]
        total = pid_sum(constants, integrals[place], errors[place], rates[place])
        if not isfinite(total):
            return False
        if constants.steers >= 0:
            errors[constants.steers] += clamped(constants.share * total, constants.most)
            continue
        for index in range(len(constants.mixing)):
            wanted[index] += constants.mixing[index] * total
    for place in range(len(loops)):
        constants = loops[place]
        error = errors[place]
        stuck = True
        if constants.steers >= 0:
            moved = constants.share * pid_sum(constants, integrals[place], error, rates[place])
            stuck = is_stuck(moved, constants.share * error, constants.most)
        else:
            for index in range(len(constants.mixing)):
                if not is_stuck(wanted[index], constants.mixing[index] * error, limits[index]):
                    stuck = False
                    break
        integrals[place] = pid_integral(constants, integrals[place], error, stuck)
    for index in range(len(limits)):
        wanted[index] = clamped(wanted[index], limits[index])
    return True


def clamped(value: float, largest: float) -> float:
    """Return the value within its limit."""
    # Comparisons: in plain Python they take a third of the time of `min` and `max`.
    if value > largest:
        return largest
    return -largest if value < -largest else value


class FeedbackLaw(NamedTuple):
    """The numbers of the law; every row is of an input."""

    base: Vector
    """the input that holds the plant where all set-points are 0, K times that state included"""
    gains: Rows
    """K: a column for each state"""
    forward: Rows
    """F: a column for each output"""
    integral_gains: Rows
    """K_i: a column for each output; 0 without integral action"""
    conditional: bool = True
    """whether an integral rests while more of it would change no input"""


def feedback_command(
    law: FeedbackLaw,
    integrals: MutableSequence[float],
    targets: Sequence[float],
    outputs: Sequence[float],
    state: Vector,
    limits: Sequence[float],
    tick_s: float,
    wanted: MutableSequence[float],
) -> bool:
    """Write the clamped inputs to `wanted` and step the integrals; False where one is not finite.

    Sessions run it as it stands, and studies compile it.
    """
    total = 0.0
    for index in range(len(law.base)):
        value = law.base[index]
        for place in range(len(state)):
            value -= law.gains[index][place] * state[place]
        for place in range(len(targets)):
            value += law.forward[index][place] * targets[place]
        for place in range(len(targets)):
            value += law.integral_gains[index][place] * integrals[place]
        wanted[index] = value
        total += value
    if not isfinite(total):
        return False
    for place in range(len(targets)):
        error = targets[place] - outputs[place]
        used, stuck = False, law.conditional
        for index in range(len(law.base)):
            gain = law.integral_gains[index][place]
            used = used or gain != 0.0
            stuck = stuck and is_stuck(wanted[index], gain * error, limits[index])
        if used and not stuck:
            integrals[place] += tick_s * error
    for index in range(len(law.base)):
        wanted[index] = clamped(wanted[index], limits[index])
    return True
