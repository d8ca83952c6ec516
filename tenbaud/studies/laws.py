"""The controllers that a flight is compiled with: the laws of `receiver.controllers`, over arrays.

Each writes what it wants of the inputs at a tick to `work.wanted` and returns whether all is well.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from channel.codec.laws import FeedbackLaw, PidConstants, feedback_command, pid_command
from channel.codec.signals import Signals
from receiver.controllers.base import Controller
from receiver.controllers.pid import PidLoops
from receiver.controllers.recorded import RecordedController
from receiver.controllers.state_feedback import StateFeedback
from tenbaud.build.controllers import rate_states
from tenbaud.studies.flight_data import Given, Work
from tenbaud.studies.parts import INPUTS
from tenbaud.studies.schedule import Uncommon


class PidLaw(NamedTuple):
    """Constants of `pid_law`; one of each per loop, but the bias."""

    loops: tuple[PidConstants, ...]
    outputs: tuple[int, ...]
    rates: tuple[int, ...]
    """states; -1: the change of the output"""
    bias: tuple[float, ...]
    tick_s: float


def pid_law(at: int, state: Any, constants: PidLaw, given: Given, work: Work) -> bool:
    """Do as `PidLoops` does."""
    loops = len(constants.loops)
    for index in range(INPUTS):
        work.wanted[index] = constants.bias[index]
    for place in range(loops):
        output = constants.outputs[place]
        value = work.live[at, output]
        work.errors[place] = given.targets[at, output] - value
        if constants.rates[place] >= 0:
            work.rates[place] = state[constants.rates[place]]
        else:
            last = work.memory[loops + place] if work.memory[-1] > 0.0 else value
            work.rates[place] = (value - last) / constants.tick_s
            work.memory[loops + place] = value
    work.memory[-1] = 1.0
    return pid_command(
        constants.loops, work.memory, work.errors, work.rates, given.command_max, work.wanted
    )


class StateLaw(NamedTuple):
    """Constants of `state_law`."""

    law: FeedbackLaw
    tick_s: float


def state_law(at: int, state: Any, constants: StateLaw, given: Given, work: Work) -> bool:
    """Do as `StateFeedback` does."""
    return feedback_command(
        constants.law,
        work.memory,
        given.targets[at],
        work.live[at],
        state,
        given.command_max,
        constants.tick_s,
        work.wanted,
    )


def recorded_law(at: int, state: Any, constants: float, given: Given, work: Work) -> bool:
    """Do as `RecordedController` does."""
    for index in range(INPUTS):
        work.wanted[index] = given.commands[at, index]
    return True


def law_of(controller: Controller, signals: Signals, tick_s: float) -> tuple[Any, Any]:
    """Return the law of a controller and its constants; Uncommon for one that has none."""
    if isinstance(controller, RecordedController):
        return recorded_law, 0.0
    if isinstance(controller, StateFeedback):
        return state_law, StateLaw(controller.law, tick_s)
    if not isinstance(controller, PidLoops):
        raise Uncommon(f"the controller {type(controller).__name__}")
    loops = controller.loops
    rates = rate_states(controller, signals)
    outputs = tuple(loop.output for loop in loops)
    constants = tuple(loop.constants for loop in loops)
    return pid_law, PidLaw(constants, outputs, rates, controller.bias, tick_s)
