"""The paper's PID law (24) and its split over the two motors (1)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, Literal, get_args

from receiver.references import Reference

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
        self._proportional = gains.proportional * per_rad
        self._integral_per_tick = gains.integral * per_rad * tick_s
        self._derivative = gains.derivative * per_rad
        self._reference = reference
        self._volts_max = float(volts_max)
        self._normal_force_volts = float(normal_force_volts)
        self._conditional = anti_windup == "conditional"
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
        pitch_volts = (
            self._proportional * error_rad + self._integral_volts - self._derivative * state[1]
        )
        if not math.isfinite(pitch_volts):
            raise ValueError(f"state at tick {tick} is {state[:2]}; it must be finite")
        self._last_tick = tick
        if not (self._conditional and self._winds_up(error_rad, pitch_volts)):
            self._integral_volts += self._integral_per_tick * error_rad
        front = (self._normal_force_volts + pitch_volts) / 2.0
        rear = (self._normal_force_volts - pitch_volts) / 2.0
        return (self._clamped(front), self._clamped(rear))

    def _winds_up(self, error_rad: float, pitch_volts: float) -> bool:
        """Whether more integral would change no motor: both stand at their limit already.

        One saturated motor is not enough: with a large w one always is, the other still steers,
        and an integral frozen there would leave a lasting error.
        """
        shared = abs(self._normal_force_volts)
        saturated = abs(pitch_volts) - shared >= 2.0 * self._volts_max
        return saturated and error_rad * pitch_volts > 0.0

    def _clamped(self, volts: float) -> float:
        return min(max(volts, -self._volts_max), self._volts_max)
