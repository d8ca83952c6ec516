"""Plants of ordinary differential equations, and their common parts.

Commands are clamped, motors lag, every place that is disturbed has its own torque, and the state takes
classical Runge-Kutta steps of order 4. A plant adds its equations: a pure function over numbers by
index that returns a tuple, so that a study can compile the very same function. The step is written so
too, and what makes a tuple of several as a function of each of its entries (`by_row`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from plant_sim.plant import PlantContext, SteppedPlant

Vector = tuple[float, ...]
Sine = Callable[[float], float]
Slopes = Callable[[Vector, Vector, Vector, Any, Sine], Vector]
"""From state, lagging commands, torques, constants and a sine to the state's derivative."""

HALF_PI = 0.5 * math.pi


def by_row(row: Callable[..., float]) -> Callable[..., Vector]:
    """Return what makes a tuple, as long as its first argument, of a function of each entry.

    A study compiles `row_function` for it.
    """

    def whole(first: Vector, *others: Any) -> Vector:
        return tuple([row(first, *others, index) for index in range(len(first))])

    whole.row_function = row  # type: ignore[attr-defined]
    return whole


class OdeConstants(NamedTuple):
    """Constants of `ode_step`."""

    equations: Any
    step_s: float
    left_half: float
    left_whole: float
    """share of a motor's lag that is left after half a step and after a whole one"""


def ode_step(
    slopes: Slopes,
    state: tuple[Vector, Vector],
    held: Vector,
    push: Vector,
    constants: OdeConstants,
    sine: Sine,
) -> tuple[Vector, Vector]:
    """Return state and motors after a step of a held command, within its limits, and held torques."""
    begin, motors = state
    equations, step_s = constants.equations, constants.step_s
    half, sixth = 0.5 * step_s, step_s / 6.0
    before = motors if constants.left_whole > 0.0 else held
    middle = _lagging(held, before, constants.left_half)
    after = _lagging(held, before, constants.left_whole)
    k1 = slopes(begin, before, push, equations, sine)
    k2 = slopes(_moved(begin, k1, half), middle, push, equations, sine)
    k3 = slopes(_moved(begin, k2, half), middle, push, equations, sine)
    k4 = slopes(_moved(begin, k3, step_s), after, push, equations, sine)
    return _averaged(begin, k1, k2, k3, k4, sixth), after


@by_row
def _lagging(held: Vector, before: Vector, left: float, index: int) -> float:
    return held[index] + (before[index] - held[index]) * left


@by_row
def _moved(state: Vector, slope: Vector, step_s: float, index: int) -> float:
    return state[index] + step_s * slope[index]


@by_row
def _averaged(
    state: Vector, k1: Vector, k2: Vector, k3: Vector, k4: Vector, sixth: float, index: int
) -> float:
    return state[index] + sixth * (k1[index] + 2.0 * (k2[index] + k3[index]) + k4[index])


class OdePlant(SteppedPlant):
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
        super().__init__(context, places)
        require_at_least_zero(motor_lag_s=motor_lag_s)
        self.slopes, self.constants = slopes, constants
        self.state: Vector = tuple(map(float, start))
        self.motors: Vector = resting or (0.0,) * len(context.command_max)
        left = [
            math.exp(-share * context.step_s / motor_lag_s) if motor_lag_s else 0.0
            for share in (0.5, 1.0)
        ]
        self.step_constants = OdeConstants(constants, context.step_s, *left)
        self._sine = context.sine
        self._outputs = outputs

    @property
    def measured(self) -> Vector:
        return self.state[: self._outputs]

    def _step(self, held: Vector, push: Vector) -> None:
        self.state, self.motors = ode_step(
            self.slopes, (self.state, self.motors), held, push, self.step_constants, self._sine
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
