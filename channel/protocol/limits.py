"""Limits of a command and its form on the wire, one of each for every input of the plant.

The receiver limits and rounds a command before it is sent; both codecs use the value decoded from
the wire, so they hold the same number. The guard beside the motors applies the same limits once
more and normally changes nothing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

from channel.codec.codec import Vector
from channel.codec.signals import STEPS_MAX, Signals

HELD_BITS = 11
"""of a command on the compact downlink, at most"""

COMMAND_MAX = 5.0
"""Where an input is clamped that has no range and is given no limit."""

PLAUSIBLE_MAX = 1e6
"""A law that wants more has lost its way; anything less is only clamped."""

NEARLY = 0.99


@dataclass(frozen=True, slots=True)
class CommandLimits:
    """Clamp and slew, one for each input, in its own unit."""

    command_max: Vector
    slew_per_tick: Vector

    @classmethod
    def of(
        cls,
        signals: Signals,
        command_max: float | Sequence[float] | None = None,
        slew_per_tick: float | Sequence[float] = math.inf,
    ) -> Self:
        """Return the limits of these inputs: one number for all, or one for each.

        Without `command_max` an input's range is its limit. ValueError, naming the input, for limits
        that do not fit the inputs or that a frame does not carry.
        """
        if command_max is None:
            ranges = [max(abs(one.low), abs(one.high)) for one in signals.inputs]
            command_max = [value if value < math.inf else COMMAND_MAX for value in ranges]
        limits = cls(
            per_input("command_max", command_max, signals),
            per_input("command_slew", slew_per_tick, signals),
        )
        for one, largest, slew in zip(
            signals.inputs, limits.command_max, limits.slew_per_tick, strict=True
        ):
            if not largest > 0.0 or not slew > 0.0:
                raise ValueError(
                    f"input {one.name}: its limit {largest:g} and its slew limit {slew:g} per tick "
                    "must be positive"
                )
        require_carried("command_max", limits.command_max, signals)
        return limits

    def apply(self, command: Sequence[float], previous: Vector) -> Vector:
        """Return the command clamped, then moved at most one slew step away from `previous`."""
        largest, step = self.command_max, self.slew_per_tick
        if len(command) == len(previous) == len(largest) == 2:
            # Twice a tick in every flight: written out, it takes half the time.
            return (
                limited(command[0], previous[0], largest[0], step[0]),
                limited(command[1], previous[1], largest[1], step[1]),
            )
        wanted = zip(command, previous, largest, step, strict=True)
        return tuple([limited(*one) for one in wanted])

    def reached(self, command: Vector) -> bool:
        """Return whether an input is at its limit, as near as the rounding of the wire lets it come."""
        for value, largest in zip(command, self.command_max, strict=True):
            if abs(value) >= NEARLY * largest:
                return True
        return False


def limited(wanted: float, before: float, largest: float, step: float) -> float:
    """Return one value within +-`largest`, at most `step` away from the one `before`."""
    value = wanted
    if value > largest:
        value = largest
    elif value < -largest:
        value = -largest
    if value > before + step:
        value = before + step
    elif value < before - step:
        value = before - step
    return value


def per_input(what: str, given: float | Sequence[float], signals: Signals) -> Vector:
    """Return one value for each input; ValueError with the numbers where a list has another length."""
    names = [one.name for one in signals.inputs]
    if isinstance(given, int | float):
        return (float(given),) * len(names)
    if len(given) != len(names):
        raise ValueError(
            f"{what} = {list(given)} has {len(given)} values; the plant has {len(names)} input(s): "
            f"{', '.join(names)}"
        )
    return tuple([float(value) for value in given])


def require_carried(what: str, command: Vector, signals: Signals) -> None:
    """Raise ValueError, with the numbers, for a command that a frame cannot hold."""
    for one, value in zip(signals.inputs, command, strict=True):
        if not abs(value) <= one.largest:
            raise ValueError(
                f"{what} of input {one.name} is {value:g} {one.unit}, and a frame carries at most "
                f"{one.largest:g}: {STEPS_MAX} steps of {1.0 / one.steps_per_unit:g} {one.unit}"
            )


def steps_held(limits: CommandLimits, signals: Signals) -> tuple[int, ...]:
    """Return how many steps of a full frame are one of the compact downlink, for each input."""
    most = (1 << HELD_BITS - 1) - 1
    return tuple([max(1, -(-one // most)) for one in to_steps(limits.command_max, signals)])


def require_movable(limits: CommandLimits, signals: Signals, per_step: Sequence[int]) -> None:
    """Raise ValueError, with the numbers, where the slew limit is below a step: nothing would move.

    `per_step`: steps of a full frame that the downlink counts as one, for each input.
    """
    for one, slew, per in zip(signals.inputs, limits.slew_per_tick, per_step, strict=True):
        step = per / one.steps_per_unit
        if slew < step * (1.0 - 1e-9):
            raise ValueError(
                f"the slew limit of input {one.name} is {slew:g} {one.unit} per tick, and the downlink "
                f"carries its command in steps of {step:g} {one.unit}; it could not move: raise "
                f"limits.command_slew_per_s to {step / slew:.3g} times its value or more"
                + ("" if per == 1 else ', lower limits.command_max, or set channel.downlink = "full"')
            )


def are_plausible(command: Sequence[float]) -> bool:
    """Return whether every value is a number, and not an absurd one."""
    # A loop: this runs at every tick, and `all` costs three times as much.
    for value in command:  # noqa: SIM110
        if not -PLAUSIBLE_MAX < value < PLAUSIBLE_MAX:
            return False
    return True


def as_carried(value: float, steps_per_unit: float) -> float:
    """Return the value of one input as the wire rounds it."""
    return round(steps_per_unit * value) / steps_per_unit


def to_steps(command: Sequence[float], signals: Signals) -> tuple[int, ...]:
    """Round a command to the whole steps that a frame carries."""
    per_unit = signals.steps_per_unit
    if len(per_unit) == 2:
        return round(per_unit[0] * command[0]), round(per_unit[1] * command[1])
    pairs = zip(per_unit, command, strict=True)
    return tuple([round(steps * value) for steps, value in pairs])


def from_steps(steps: Sequence[int], signals: Signals) -> Vector:
    """Return the command that both codecs use for the steps of a frame."""
    per_unit = signals.steps_per_unit
    if len(per_unit) == 2:
        return steps[0] / per_unit[0], steps[1] / per_unit[1]
    return tuple([value / one for value, one in zip(steps, per_unit, strict=True)])
