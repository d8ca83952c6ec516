"""Feedback of all states: u = base + F r - K x + K_i z, z being the integrals of the errors."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from channel.codec.laws import FeedbackLaw, feedback_command
from receiver.controllers.references import Reference

Vector = tuple[float, ...]


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
