"""Feedback of all states: u = base + F r - K x + K_i z, z being the integrals of the errors."""

from __future__ import annotations

import math
from collections.abc import Callable, MutableSequence, Sequence
from typing import NamedTuple

from receiver.controllers.pid import clamped, is_stuck
from receiver.controllers.references import Reference

Vector = tuple[float, ...]
Rows = tuple[Vector, ...]


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
    if not math.isfinite(total):
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


class StateFeedback:
    """A `Controller`: the law above, each input within its limit.

    `outputs` reads the outputs from a state; `references` are their set-points, None for those that
    are left to themselves.
    """

    def __init__(
        self,
        law: FeedbackLaw,
        references: Sequence[Reference | None],
        outputs: Callable[[Vector], Vector],
        command_max: Vector,
        tick_s: float,
    ) -> None:
        self.law = law
        self.integrals = [0.0] * len(references)
        """of the errors of the outputs, times seconds"""
        self._references = tuple(references)
        self._outputs = outputs
        self._command_max = command_max
        self.tick_s = tick_s

    def references(self, tick: int) -> tuple[float | None, ...]:
        return tuple([None if one is None else one.value(tick) for one in self._references])

    def command(self, tick: int, state: Vector) -> Vector:
        """Return one value for each input; ValueError for a state that is not finite."""
        targets = [0.0 if one is None else one.value(tick) for one in self._references]
        wanted = [0.0] * len(self.law.base)
        if not feedback_command(
            self.law,
            self.integrals,
            targets,
            self._outputs(state),
            state,
            self._command_max,
            self.tick_s,
            wanted,
        ):
            raise ValueError(f"state at tick {tick} is {state}; it must be finite")
        return tuple(wanted)
