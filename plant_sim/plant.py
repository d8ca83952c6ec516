"""The interface of every simulated plant."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from plant_sim.disturbance import Disturbance, PlannedDisturbance, Pushes


@dataclass(frozen=True, slots=True)
class PlantContext:
    """The context that an external plant gets when it is built."""

    step_s: float
    """time that one call of `advance` simulates"""
    seed: int
    """of all random numbers"""
    command_max: tuple[float, ...]
    """where each input is clamped"""
    mismatch: float | tuple[float, ...]
    """fraction by which the plant differs from the codec's model"""
    disturbance: Disturbance | None
    """configured torque: `disturbance.torque(step)`, rad/s^2"""
    initial: tuple[float, ...] = ()
    """value of each output at the start, as far as it is configured"""
    model: Mapping[str, Any] = field(default_factory=dict)
    """the settings of the codec's model, which the plant resembles"""
    sine: Callable[[float], float] = math.sin
    """how a sine is taken: with the codec's own a simulated flight is the same on every machine"""
    inputs: tuple[str, ...] = ()
    """names of the model's inputs, in the order of a command"""
    outputs: tuple[str, ...] = ()
    """names of the model's outputs, which are the plant's"""
    disturbance_text: str = ""
    """configured disturbance, for a plant that is disturbed in several places"""

    def disturbances(self, places: int) -> tuple[PlannedDisturbance, ...]:
        """Return the disturbance of each place, none of them where none is configured.

        ValueError for a configured disturbance that has more places.
        """
        if not self.disturbance_text:
            return ()
        from plant_sim.disturbance import parse_disturbance, require_places

        require_places(self.disturbance_text, places)
        return tuple(
            [
                parse_disturbance(self.disturbance_text, self.step_s, self.seed, place)
                for place in range(places)
            ]
        )


class Plant(Protocol):
    """A plant advanced in fixed steps of a held command.

    A plant is independent of encoders, symbols and network: it takes commands and has true outputs.
    The length of one step is fixed when the plant is built, because lags and integration constants
    are computed once for it.
    """

    @property
    def measured(self) -> tuple[float, ...]:
        """True value of each output, in the model's order and units; angles unwrapped."""
        ...

    def advance(self, volts: tuple[float, ...]) -> None:
        """Hold one value per input for exactly one step; the plant does its own clamping.

        Raises ValueError when the number of values is not the number of inputs, or when one of
        them is not finite.
        """
        ...


def held_command(command: Sequence[float], largest: Sequence[float]) -> tuple[float, ...]:
    """Return a command within the limits of its inputs, as `Plant.advance` asks for."""
    if len(command) != len(largest):
        raise ValueError(f"{len(command)} value(s) given; the plant has {len(largest)} input(s)")
    if not all(map(math.isfinite, command)):
        raise ValueError(f"the command is {tuple(command)}; it must be finite")
    return tuple([min(max(one, -most), most) for one, most in zip(command, largest, strict=True)])


class SteppedPlant(ABC):
    """The common part of plants: commands within their limits, and the disturbances of a step."""

    def __init__(self, context: PlantContext, places: int) -> None:
        """Take the disturbances of `places` places of the plant."""
        self._command_max = context.command_max
        self._disturbances = context.disturbances(places)
        self._still = (0.0,) * places
        self._steps = 0

    def pushes(self, steps: int) -> Pushes:
        """Return the disturbance of the first steps, a column per place."""
        from plant_sim.disturbance import pushes_of

        return pushes_of(self._disturbances or (None,) * len(self._still), steps)

    def advance(self, command: tuple[float, ...]) -> None:
        held = held_command(command, self._command_max)
        push = tuple([one.torque(self._steps) for one in self._disturbances]) or self._still
        self._steps += 1
        self._step(held, push)

    @abstractmethod
    def _step(self, held: tuple[float, ...], push: tuple[float, ...]) -> None:
        """Advance by a step of a held command and held disturbances."""
