"""The paper's PID law (24) and its split over the two motors (1)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, Literal, NamedTuple, get_args

from receiver.controllers.references import Reference

GainUnit = Literal["V/rad", "V/deg"]
AntiWindup = Literal["conditional", "none"]


@dataclass(frozen=True, slots=True)
class PidGains:
    """Gains of (24): `proportional` is kP, `integral` kI (per second), `derivative` kD (seconds).

    `unit` has no default: the same three numbers differ by a factor of 57 between V/rad and V/deg.
    Gains are finite and at least 0.
    """

    proportional: float
    integral: float
    derivative: float
    unit: GainUnit

    def __post_init__(self) -> None:
        """Refuse gains that would push away from the reference, and unknown units."""
        for name in ("proportional", "integral", "derivative"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0.0):
                raise ValueError(f"gain {name} is {value}; it must be finite and at least 0")
        if self.unit not in get_args(GainUnit):
            raise ValueError(f"gain unit is '{self.unit}'; it must be 'V/rad' or 'V/deg'")


# The paper prints no unit. In V/rad the loop cannot reach the reference at all; in V/deg it behaves
# like the Ziegler-Nichols loop the paper describes, so degrees are meant.
PAPER_GAINS: Final = PidGains(proportional=0.1, integral=0.053, derivative=0.12, unit="V/deg")


class PidConstants(NamedTuple):
    """Constants of the functions below; volts and radians."""

    proportional: float
    integral_per_tick: float
    derivative: float
    volts_max: float
    normal_force_volts: float
    conditional: bool
    """whether the integral rests while more of it would change no motor"""


def pid_volts(
    constants: PidConstants, integral_volts: float, error_rad: float, rate_rad_s: float
) -> float:
    """Return u of (24)."""
    return constants.proportional * error_rad + integral_volts - constants.derivative * rate_rad_s


def pid_integral(
    constants: PidConstants, integral_volts: float, error_rad: float, pitch_volts: float
) -> float:
    """Return the integral term of the next tick.

    It winds up when more of it would change no motor: both stand at their limit already. One saturated
    motor is not enough: with a large w one always is, the other still steers, and an integral frozen
    there would leave a lasting error.
    """
    if constants.conditional:
        shared = abs(constants.normal_force_volts)
        saturated = abs(pitch_volts) - shared >= 2.0 * constants.volts_max
        if saturated and error_rad * pitch_volts > 0.0:
            return integral_volts
    return integral_volts + constants.integral_per_tick * error_rad


def motor_volts(constants: PidConstants, pitch_volts: float) -> tuple[float, float]:
    """Return (front, rear) of (1), each within its limit."""
    largest = constants.volts_max
    front = (constants.normal_force_volts + pitch_volts) / 2.0
    rear = (constants.normal_force_volts - pitch_volts) / 2.0
    # Comparisons: in plain Python they take a third of the time of `min` and `max`.
    if front > largest:
        front = largest
    elif front < -largest:
        front = -largest
    if rear > largest:
        rear = largest
    elif rear < -largest:
        rear = -largest
    return front, rear


class Pid:
    """A `Controller`: u = kP eps + kI int(eps) - kD rate, then one voltage per motor.

    The derivative acts on the estimated rate, not on the error, so a jump of the reference gives no
    kick. The integral is a rectangle sum of past ticks; the present error enters with the next one.
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
        per_rad = math.degrees(1.0) if gains.unit == "V/deg" else 1.0
        self.constants = PidConstants(
            gains.proportional * per_rad,
            gains.integral * per_rad * tick_s,
            gains.derivative * per_rad,
            float(volts_max),
            float(normal_force_volts),
            anti_windup == "conditional",
        )
        self._reference = reference
        self._integral_volts = 0.0
        self._last_tick: int | None = None

    @property
    def integral_volts(self) -> float:
        """The integral term of u, in volts."""
        return self._integral_volts

    def reference_rad(self, tick: int) -> float:
        """Return the reference angle at `tick`."""
        return self._reference.angle_rad(tick)

    def command(self, tick: int, state: tuple[float, ...]) -> tuple[float, float]:
        """Return (front, rear) volts for `tick`, each within +-`volts_max`.

        Reads the first two entries of `state`: angle (rad) and rate (rad/s). Ticks must rise; over
        a gap, which a rejoin leaves, the integral rests. Raises ValueError for a tick that does
        not rise and for a state that is not finite, and then leaves the controller as it was.
        """
        if self._last_tick is not None and tick <= self._last_tick:
            raise ValueError(f"tick is {tick}; it must be above the last one, {self._last_tick}")
        error_rad = self._reference.angle_rad(tick) - state[0]
        pitch_volts = pid_volts(self.constants, self._integral_volts, error_rad, state[1])
        if not math.isfinite(pitch_volts):
            raise ValueError(f"state at tick {tick} is {state[:2]}; it must be finite")
        self._last_tick = tick
        self._integral_volts = pid_integral(
            self.constants, self._integral_volts, error_rad, pitch_volts
        )
        return motor_volts(self.constants, pitch_volts)
