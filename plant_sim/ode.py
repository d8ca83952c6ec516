"""Plants of ordinary differential equations, and what they have in common.

Commands are clamped, motors lag, every place that is disturbed has its own torque, and the state takes
classical Runge-Kutta steps of order 4. A plant adds its equations: a pure function over numbers by
index that returns a tuple, so that a study can compile the very same function.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

from plant_sim.plant import PlantContext, held_command

Vector = tuple[float, ...]
Sine = Callable[[float], float]
Slopes = Callable[[Vector, Vector, Vector, Any, Sine], Vector]
"""From state, lagging commands, torques, constants and a sine to the state's derivative."""

HALF_PI = 0.5 * math.pi


class OdePlant:
    """A `Plant` of equations; its outputs are the first of its states.

    A held command reaches the equations through the motors' lag, which is exact. Motors start with the
    command `resting`.
    """

    def __init__(
        self,
        context: PlantContext,
        slopes: Slopes,
        constants: Any,
        start: Sequence[float],
        *,
        outputs: int = 1,
        places: int = 1,
        motor_lag_s: float = 0.0,
        resting: Vector = (),
    ) -> None:
        require_at_least_zero(motor_lag_s=motor_lag_s)
        self.slopes, self.constants = slopes, constants
        self.state: Vector = tuple(map(float, start))
        self.motors: Vector = resting or (0.0,) * len(context.command_max)
        self.step_s = context.step_s
        self.left = (
            (math.exp(-0.5 * self.step_s / motor_lag_s), math.exp(-self.step_s / motor_lag_s))
            if motor_lag_s
            else (0.0, 0.0)
        )
        """share of a motor's lag that is left after half a step and after a whole one"""
        self._command_max = context.command_max
        self._disturbances = context.disturbances(places)
        self._still = (0.0,) * places
        self._sine = context.sine
        self._outputs = outputs
        self._steps = 0

    @property
    def measured(self) -> Vector:
        """The outputs."""
        return self.state[: self._outputs]

    def advance(self, command: Vector) -> None:
        """Hold a command, clamped, for one step; ValueError for one that is no command."""
        held = held_command(command, self._command_max)
        half, whole = self.left
        before = self.motors if whole else held
        middle = tuple([now + (one - now) * half for now, one in zip(held, before, strict=True)])
        self.motors = tuple([now + (one - now) * whole for now, one in zip(held, before, strict=True)])
        step = self._steps
        torques = tuple([one.torque(step) for one in self._disturbances]) or self._still
        self._steps += 1
        self.state = runge_kutta(
            self.slopes,
            self.state,
            (before, middle, self.motors),
            torques,
            self.constants,
            self._sine,
            self.step_s,
        )


def runge_kutta(
    slopes: Slopes,
    state: Vector,
    motors: tuple[Vector, Vector, Vector],
    torques: Vector,
    constants: Any,
    sine: Sine,
    step_s: float,
) -> Vector:
    """Return the state after a classical step of order 4; `motors` at its start, middle and end."""
    begin, middle, end = motors
    half, sixth = 0.5 * step_s, step_s / 6.0
    k1 = slopes(state, begin, torques, constants, sine)
    at = tuple([x + half * k for x, k in zip(state, k1, strict=True)])
    k2 = slopes(at, middle, torques, constants, sine)
    at = tuple([x + half * k for x, k in zip(state, k2, strict=True)])
    k3 = slopes(at, middle, torques, constants, sine)
    at = tuple([x + step_s * k for x, k in zip(state, k3, strict=True)])
    k4 = slopes(at, end, torques, constants, sine)
    return tuple(
        [
            x + sixth * (a + 2.0 * (b + c) + d)
            for x, a, b, c, d in zip(state, k1, k2, k3, k4, strict=True)
        ]
    )


def rub(rate: float, friction: float, slow: float) -> float:
    """Return dry friction against a rate; it gives way below the rate `slow`."""
    return friction * rate / (abs(rate) + slow)


def started(context: PlantContext, usual: Sequence[float]) -> Vector:
    """Return the outputs at the start: as far as configured, else the usual ones."""
    return (*context.initial, *usual[len(context.initial) :])


def fractions(context: PlantContext) -> tuple[float, float, float]:
    """Return by which fraction damping, stiffness and gain are off."""
    off = context.mismatch
    return (off[0], off[1], off[2]) if isinstance(off, tuple) else (off, off, off)


def require_at_least_zero(**values: float) -> None:
    """Raise ValueError for one that is below 0 or not finite."""
    for name, value in values.items():
        if not 0.0 <= value < math.inf:
            raise ValueError(f"{name} is {value}; it must be finite and at least 0")
