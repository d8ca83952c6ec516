"""The interface of every simulated plant."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from plant_sim.disturbance import Disturbance


@dataclass(frozen=True, slots=True)
class PlantContext:
    """The context that a plant from outside gets when it is built."""

    step_s: float
    """what one call of `advance` simulates"""
    seed: int
    """of everything random"""
    command_max: tuple[float, ...]
    """where each input is clamped"""
    mismatch: float | tuple[float, ...]
    """fraction by which the plant is to be off the codec's model"""
    disturbance: Disturbance | None
    """configured torque: `disturbance.torque(step)`, rad/s^2"""
    initial_angle_rad: float
    model: Mapping[str, Any] = field(default_factory=dict)
    """the settings of the codec's model, which the plant is to be near"""
    sine: Callable[[float], float] = math.sin
    """how a sine is taken: with the codec's own a simulated flight is the same on every machine"""
    inputs: tuple[str, ...] = ()
    """names of the model's inputs, in the order of a command"""
    outputs: tuple[str, ...] = ()
    """names of the model's outputs, which are what the plant has"""

    @property
    def volts_max(self) -> float:
        """Return where the first input is clamped, as it was called before inputs had names."""
        return self.command_max[0]


class Plant(Protocol):
    """A plant advanced in fixed steps of held voltage.

    A plant knows nothing of encoders, symbols or the network: it takes volts and has true angles.
    The length of one step is fixed when the plant is built, because lags and integration constants
    are computed once for it.
    """

    @property
    def measured_rad(self) -> tuple[float, ...]:
        """True angle of each axis that carries an encoder, in rad, unwrapped, in encoder order."""
        ...

    def advance(self, volts: tuple[float, ...]) -> None:
        """Hold one voltage per motor for exactly one step; the plant does its own clamping.

        Raises ValueError when the number of voltages is not the number of motors, or when one of
        them is not finite.
        """
        ...
