"""The paper's PID law (24), a loop for each output that is steered, split over the inputs as in (1)."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from operator import itemgetter
from typing import Final, Literal, get_args

from channel.codec.laws import PidConstants, pid_command
from receiver.controllers.references import Reference

AntiWindup = Literal["conditional", "none"]
Vector = tuple[float, ...]
Reading = Callable[[Vector], float]
"""Model state -> an output, or its rate."""


@dataclass(frozen=True, slots=True)
class PidGains:
    """Gains of (24): `proportional` is kP, `integral` kI (per second), `derivative` kD (seconds).

    `unit` has no default: the same three numbers differ by a factor of 57 between V/rad and V/deg.
    Gains are finite and at least 0.
    """

    proportional: float
    integral: float
    derivative: float
    unit: str

    def __post_init__(self) -> None:
        for name in ("proportional", "integral", "derivative"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0.0):
                raise ValueError(f"gain {name} is {value}; it must be finite and at least 0")

    def per_tick(self, tick_s: float, output_unit: str = "rad") -> tuple[float, float, float]:
        """Return kP, kI per tick and kD in units of the output; ValueError for another unit."""
        over = self.unit.rpartition("/")[2]
        if over != output_unit and (over, output_unit) != ("deg", "rad"):
            raise ValueError(
                f"gain unit is '{self.unit}'; it must be per {output_unit}"
                + (" or per deg, such as 'V/rad' or 'V/deg'" if output_unit == "rad" else "")
            )
        scale = math.degrees(1.0) if over != output_unit else 1.0
        return (self.proportional * scale, self.integral * scale * tick_s, self.derivative * scale)


# The paper prints no unit. In V/rad the loop cannot reach the reference at all; in V/deg it behaves
# like the Ziegler-Nichols loop the paper describes, so degrees are meant.
PAPER_GAINS: Final = PidGains(proportional=0.1, integral=0.053, derivative=0.12, unit="V/deg")


@dataclass(frozen=True, slots=True)
class Loop:
    """One output that is steered."""

    constants: PidConstants
    reference: Reference | None
    """None: 0, to which a loop that steers this one adds"""
    output: int
    """its place among the outputs"""
    value: Reading
    rate: Reading


def _nothing(tick: int) -> float:
    """Return the set-point of a loop that has none."""
    return 0.0


class PidLoops:
    """A `Controller`: for each loop u = kP eps + kI int(eps) - kD rate, mixed into the inputs.

    The derivative acts on the estimated rate, not on the error, so a jump of the reference gives no
    kick. The integral is a rectangle sum of past ticks; the present error enters with the next one.
    """

    def __init__(self, loops: Sequence[Loop], command_max: Vector, bias: Vector) -> None:
        """Control by `loops`; `bias` is the input without them.

        Each input saturates at its `command_max`.
        """
        self.loops = tuple(loops)
        self.command_max = command_max
        self.bias = bias
        self.integrals = [0.0] * len(self.loops)
        """the integral term of each loop's u"""
        self._constants = tuple([loop.constants for loop in self.loops])
        self._readings = [
            (_nothing if loop.reference is None else loop.reference.value, loop.value, loop.rate)
            for loop in self.loops
        ]
        self._outputs = 1 + max([loop.output for loop in loops], default=-1)
        self._last_tick: int | None = None

    def references(self, tick: int) -> tuple[float | None, ...]:
        found: list[float | None] = [None] * self._outputs
        for loop in self.loops:
            if loop.reference is not None:
                found[loop.output] = loop.reference.value(tick)
        return tuple(found)

    def command(self, tick: int, state: Vector) -> Vector:
        """Return one value for each input, each within its limit.

        Ticks must rise; over a gap, which a rejoin leaves, the integrals rest. Raises ValueError for a
        tick that does not rise and for a state that is not finite, and then leaves the controller as
        it was.
        """
        if self._last_tick is not None and tick <= self._last_tick:
            raise ValueError(f"tick is {tick}; it must be above the last one, {self._last_tick}")
        wanted = list(self.bias)
        errors, rates = [], []
        for target, value, rate in self._readings:
            errors.append(target(tick) - value(state))
            rates.append(rate(state))
        if not pid_command(self._constants, self.integrals, errors, rates, self.command_max, wanted):
            raise ValueError(f"state at tick {tick} is {state}; it must be finite")
        self._last_tick = tick
        return tuple(wanted)


class Pid(PidLoops):
    """The paper's: the angle steered by the difference of two motors, front and rear.

    It reads the first two entries of the state: angle (rad) and rate (rad/s).
    """

    def __init__(
        self,
        gains: PidGains,
        reference: Reference,
        tick_s: float,
        *,
        volts_max: float = 5.0,
        normal_force_volts: float = 0.0,
        anti_windup: AntiWindup = "conditional",
    ) -> None:
        """Follow `reference` with one command every `tick_s` seconds.

        `normal_force_volts` is w of (1), the voltage both motors share; `volts_max` (above 0) is
        where each motor saturates. ValueError for anything out of its range.
        """
        for name, value in (("tick_s", tick_s), ("volts_max", volts_max)):
            if not (math.isfinite(value) and value > 0.0):
                raise ValueError(f"{name} is {value}; it must be finite and above 0")
        if not math.isfinite(normal_force_volts):
            raise ValueError(f"normal_force_volts is {normal_force_volts}; it must be finite")
        if anti_windup not in get_args(AntiWindup):
            raise ValueError(f"anti_windup is '{anti_windup}'; it must be 'conditional' or 'none'")
        conditional = anti_windup == "conditional"
        kp, ki, kd = gains.per_tick(tick_s)
        constants = PidConstants(kp, ki, kd, (0.5, -0.5), conditional)
        loop = Loop(constants, reference, 0, itemgetter(0), itemgetter(1))
        bias = normal_force_volts / 2.0
        super().__init__((loop,), (float(volts_max),) * 2, (bias, bias))
