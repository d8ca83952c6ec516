"""Feedback of all states: u = base + F r - K x + K_i z, z being the integrals of the errors."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from receiver.controllers.pid import clamped, is_stuck
from receiver.controllers.references import Reference

Vector = tuple[float, ...]
Rows = tuple[Vector, ...]


@dataclass(frozen=True, slots=True)
class FeedbackLaw:
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
        self._tick_s = tick_s
        self._integrated = [
            place for place in range(len(references)) if any(row[place] for row in law.integral_gains)
        ]

    def references(self, tick: int) -> tuple[float | None, ...]:
        """Return the set-point of each output at `tick`."""
        return tuple([None if one is None else one.value(tick) for one in self._references])

    def command(self, tick: int, state: Vector) -> Vector:
        """Return one value for each input; ValueError for a state that is not finite."""
        law, integrals = self.law, self.integrals
        wanted_outputs = [0.0 if one is None else one.value(tick) for one in self._references]
        wanted = []
        for base, gains, forward, integral in zip(
            law.base, law.gains, law.forward, law.integral_gains, strict=True
        ):
            value = base
            for gain, one in zip(gains, state, strict=True):
                value -= gain * one
            for share, one in zip(forward, wanted_outputs, strict=True):
                value += share * one
            for share, one in zip(integral, integrals, strict=True):
                value += share * one
            wanted.append(value)
        if not math.isfinite(sum(wanted)):
            raise ValueError(f"state at tick {tick} is {state}; it must be finite")
        if self._integrated:
            self._integrate(wanted, wanted_outputs, self._outputs(state))
        return tuple(map(clamped, wanted, self._command_max))

    def _integrate(self, wanted: Sequence[float], targets: Sequence[float], outputs: Vector) -> None:
        for place in self._integrated:
            error = targets[place] - outputs[place]
            stuck = self.law.conditional
            for row, value, largest in zip(
                self.law.integral_gains, wanted, self._command_max, strict=True
            ):
                stuck = stuck and is_stuck(value, row[place] * error, largest)
            if not stuck:
                self.integrals[place] += self._tick_s * error
