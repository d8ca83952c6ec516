"""Mirrored laws: equal to the receiver's controllers, and refused where two machines need not agree."""

from __future__ import annotations

import math
import random
import time
from dataclasses import dataclass
from operator import itemgetter
from typing import Any

import pytest

from channel.codec.codec import Vector
from channel.codec.downlink.laws import MirroredFeedback, MirroredLoop, MirroredPid, check_law
from channel.codec.laws import FeedbackLaw, PidConstants
from channel.codec.models.pitch import PitchModel, PitchParameters
from receiver.controllers.pid import PAPER_GAINS, Loop, PidLoops
from receiver.controllers.references import Constant, Square
from receiver.controllers.state_feedback import StateFeedback
from tenbaud.build.controllers import Difference

MODEL = PitchModel(PitchParameters(), 0.01)
TICK_S = 0.01
LIMITS = (5.0, 5.0)


def states(count: int) -> list[Vector]:
    chance = random.Random(7)
    return [tuple([chance.gauss(0.0, 1.0) for _ in range(4)]) for _ in range(count)]


@pytest.mark.parametrize("rate", [1, -1])
def test_the_mirrored_pid_commands_what_the_receivers_does(rate: int) -> None:
    constants = PidConstants(*PAPER_GAINS.per_tick(TICK_S), (0.5, -0.5), True)
    mirror = MirroredPid((MirroredLoop(constants, 0, rate),), LIMITS, (0.5, 0.5), TICK_S)
    reference = Square(1.5, 0.4, TICK_S)
    value = itemgetter(0)
    reading = itemgetter(1) if rate >= 0 else Difference(value, TICK_S)
    own = PidLoops((Loop(constants, reference, 0, value, reading),), LIMITS, (0.5, 0.5))
    memory = mirror.initial()
    for tick, state in enumerate(states(200)):
        command, memory = mirror.command(memory, (reference.value(tick),), state[:1], state)
        assert command == own.command(tick, state)


def test_the_mirrored_feedback_commands_what_the_receivers_does() -> None:
    law = FeedbackLaw(
        (0.2, -0.2),
        ((3.0, 1.0, 0.1, 0.0), (-3.0, -1.0, 0.0, 0.1)),
        ((3.0,), (-3.0,)),
        ((1.0,), (-1.0,)),
    )
    own = StateFeedback(law, (Constant(0.4, TICK_S),), MODEL.measured, LIMITS, TICK_S)
    mirror = MirroredFeedback(law, LIMITS, TICK_S)
    check_law(mirror, MODEL)
    memory = mirror.initial()
    for tick, state in enumerate(states(200)):
        command, memory = mirror.command(memory, (0.4,), MODEL.measured(state), state)
        assert command == own.command(tick, state)


@dataclass
class Given:
    """A law made of one function of the angle."""

    function: Any

    def initial(self) -> Vector:
        return (0.0,)

    def command(
        self, memory: Vector, targets: Vector, outputs: Vector, state: Vector
    ) -> tuple[Vector, Vector]:
        value = self.function(self, state[0])
        return (value, -value), memory


class Counting(Given):
    """Remembers what is not in its memory."""

    calls = 0.0

    def command(
        self, memory: Vector, targets: Vector, outputs: Vector, state: Vector
    ) -> tuple[Vector, Vector]:
        self.calls += 1.0
        return (self.calls, state[0]), memory


class Powers(Given):
    """Uses `**`, and a function of the C library."""

    def command(
        self, memory: Vector, targets: Vector, outputs: Vector, state: Vector
    ) -> tuple[Vector, Vector]:
        return (state[0] ** 2, math.sin(state[0])), memory


class Sums(Given):
    """Uses what differs between two versions of Python."""

    def command(
        self, memory: Vector, targets: Vector, outputs: Vector, state: Vector
    ) -> tuple[Vector, Vector]:
        return (sum(state), time.time()), memory


@pytest.mark.parametrize(
    ("law", "why"),
    [
        (Given(lambda law, angle: 0.5 * angle), ""),
        (Given(lambda law, angle: 1), r"\(1, -1\); plain finite floats"),
        (Given(lambda law, angle: math.inf), "plain finite floats"),
        (Counting(None), "for the same arguments"),
        (Powers(None), r"uses \*\*; .*uses math.sin"),
        (Sums(None), r"uses sum\(\); .*uses the module time"),
    ],
)
def test_a_law_that_breaks_the_rules_is_refused_with_the_reason(law: Given, why: str) -> None:
    if not why:
        check_law(law, MODEL)
        return
    with pytest.raises(ValueError, match=why):
        check_law(law, MODEL)


def test_a_command_for_another_plant_is_refused() -> None:
    law = MirroredFeedback(FeedbackLaw((0.0,), ((1.0,) * 4,), ((1.0,),), ((0.0,),)), (5.0,), TICK_S)
    with pytest.raises(ValueError, match="a tuple of 2 floats is needed"):
        check_law(law, MODEL)
