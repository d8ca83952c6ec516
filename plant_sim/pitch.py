"""Pitch axis of the helicopter: equations (2)-(4) of the paper, in the form (11), (12).

    theta'' + a_w theta' + a_th sin(theta - theta_0) = k_v mu + torque      (11)
    T_m vbar_i' + vbar_i = v_i,      mu = vbar_f - vbar_r                   (12)

`pitch_step` is a pure function over flat tuples of floats, so that a study can compile the very
same function; `PitchPlant` wraps it for everyday use.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from plant_sim.disturbance import Disturbance, Pushes, pushes_of

PitchState = tuple[float, float, float, float]
"""Angle (rad), rate (rad/s), lagged front voltage (V), lagged rear voltage (V)."""

Sine = Callable[[float], float]
"""How a sine is taken; `math.sin` differs in its last bit between C libraries and processors."""

PitchConstants = tuple[float, float, float, float, float, float, float, float]
"""Constants that `pitch_constants` precomputes for `pitch_step`."""


@dataclass(frozen=True, slots=True)
class PitchParameters:
    """Constants of (11) and (12); the defaults are the paper's.

    `rate_damping_per_s` is a_w, `stiffness_per_s2` a_th, `torque_gain_rad_per_v_s2` k_v,
    `equilibrium_rad` theta_0 and `motor_lag_s` T_m. Damping and stiffness are at least 0, the lag
    and `volts_max` above 0, all finite; anything else raises ValueError.
    """

    rate_damping_per_s: float = 0.1
    stiffness_per_s2: float = 0.5
    torque_gain_rad_per_v_s2: float = 0.35
    equilibrium_rad: float = -0.115
    motor_lag_s: float = 0.08
    volts_max: float = 5.0

    def __post_init__(self) -> None:
        for name in ("rate_damping_per_s", "stiffness_per_s2"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0.0):
                raise ValueError(f"{name} is {value}; it must be finite and at least 0")
        for name in ("motor_lag_s", "volts_max"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise ValueError(f"{name} is {value}; it must be finite and above 0")
        for name in ("torque_gain_rad_per_v_s2", "equilibrium_rad"):
            value = getattr(self, name)
            if not math.isfinite(value):
                raise ValueError(f"{name} is {value}; it must be finite")

    def mismatched(self, fraction: float | tuple[float, float, float]) -> PitchParameters:
        """Return a plant that is off these constants: each is multiplied by 1 + its fraction.

        Three fractions are for damping, stiffness and torque gain, in this order; one is for all.
        """
        damping, stiffness, gain = (
            fraction if isinstance(fraction, tuple) else (fraction, fraction, fraction)
        )
        return replace(
            self,
            rate_damping_per_s=self.rate_damping_per_s * (1.0 + damping),
            stiffness_per_s2=self.stiffness_per_s2 * (1.0 + stiffness),
            torque_gain_rad_per_v_s2=self.torque_gain_rad_per_v_s2 * (1.0 + gain),
        )


def pitch_constants(parameters: PitchParameters, step_s: float) -> PitchConstants:
    """Precompute the constants of `pitch_step` for steps of `step_s` seconds (finite, above 0).

    In order: a_w, a_th, k_v, theta_0, largest voltage, step, and the share of a motor's lag that
    is left after half a step and after a whole one.
    """
    if not (math.isfinite(step_s) and step_s > 0.0):
        raise ValueError(f"step_s is {step_s}; it must be finite and above 0")
    return (
        float(parameters.rate_damping_per_s),
        float(parameters.stiffness_per_s2),
        float(parameters.torque_gain_rad_per_v_s2),
        float(parameters.equilibrium_rad),
        float(parameters.volts_max),
        float(step_s),
        math.exp(-0.5 * step_s / parameters.motor_lag_s),
        math.exp(-step_s / parameters.motor_lag_s),
    )


def pitch_step(
    state: PitchState,
    volts: tuple[float, float],
    push: tuple[float, ...],
    constants: PitchConstants,
    sine: Sine = math.sin,
) -> PitchState:
    """Advance (11), (12) by one step of held `volts` (front, rear) and `push`: the torque, rad/s^2.

    The lag of a held voltage is exact (an exponential); angle and rate take one classical
    Runge-Kutta step of order 4 that sees the exact mu at the start, the middle and the end.
    `k1 ... k4` are the textbook's slopes of the rate, `w2 ... w4` the rates they are taken at
    (the slopes of the angle).
    """
    theta, omega, front, rear = state
    a_w, a_th, k_v, theta_0, volts_max, h, left_half, left_whole = constants
    v_f, v_r = volts
    torque = push[0]
    if v_f > volts_max:
        v_f = volts_max
    elif v_f < -volts_max:
        v_f = -volts_max
    if v_r > volts_max:
        v_r = volts_max
    elif v_r < -volts_max:
        v_r = -volts_max

    # Both motors share one lag, so mu itself obeys (12) with the voltage difference.
    mu_held = v_f - v_r
    mu_excess = front - rear - mu_held
    push_start = k_v * (mu_held + mu_excess) + torque
    push_middle = k_v * (mu_held + mu_excess * left_half) + torque
    push_end = k_v * (mu_held + mu_excess * left_whole) + torque

    half = 0.5 * h
    k1 = push_start - a_w * omega - a_th * sine(theta - theta_0)
    w2 = omega + half * k1
    k2 = push_middle - a_w * w2 - a_th * sine(theta + half * omega - theta_0)
    w3 = omega + half * k2
    k3 = push_middle - a_w * w3 - a_th * sine(theta + half * w2 - theta_0)
    w4 = omega + h * k3
    k4 = push_end - a_w * w4 - a_th * sine(theta + h * w3 - theta_0)
    return (
        theta + h / 6.0 * (omega + 2.0 * (w2 + w3) + w4),
        omega + h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4),
        v_f + (front - v_f) * left_whole,
        v_r + (rear - v_r) * left_whole,
    )


class PitchPlant:
    """The pitch axis as a `Plant`: two motors (front, rear), one measured angle.

    `disturbance` gives the torque of each step, counted from 0; it must have been built for the
    same `step_s`. Without one the torque is 0. The motors start at rest.
    """

    __slots__ = ("_disturbance", "_sine", "_step_index", "constants", "state")

    step_function = staticmethod(pitch_step)

    def __init__(
        self,
        parameters: PitchParameters,
        step_s: float,
        disturbance: Disturbance | None = None,
        initial_angle_rad: float = 0.0,
        initial_rate: float = 0.0,
        sine: Sine = math.sin,
    ) -> None:
        """Start at `initial_angle_rad` (rad) and `initial_rate` (rad/s), both finite.

        `sine` is `math.sin` or one whose bits do not depend on the machine.
        """
        for name, value in (("initial_angle_rad", initial_angle_rad), ("initial_rate", initial_rate)):
            if not math.isfinite(value):
                raise ValueError(f"{name} is {value}; it must be finite")
        self.constants = pitch_constants(parameters, step_s)
        self._disturbance = disturbance
        self._sine = sine
        self.state: PitchState = (float(initial_angle_rad), float(initial_rate), 0.0, 0.0)
        self._step_index = 0

    @property
    def angle_rad(self) -> float:
        """True pitch angle, unwrapped."""
        return self.state[0]

    @property
    def rate_rad_s(self) -> float:
        """True pitch rate."""
        return self.state[1]

    def pushes(self, steps: int) -> Pushes:
        return pushes_of((self._disturbance,), steps)

    @property
    def measured(self) -> tuple[float, ...]:
        return (self.state[0],)

    def advance(self, volts: tuple[float, ...]) -> None:
        """Hold the voltages (front, rear) for one step; they are clamped to `volts_max`.

        Raises ValueError for any other number of voltages, or for one that is not finite.
        """
        if len(volts) != 2:
            raise ValueError(f"{len(volts)} voltages given; the pitch axis takes 2 (front, rear)")
        front, rear = volts
        if not (math.isfinite(front) and math.isfinite(rear)):
            raise ValueError(f"motor voltages are {volts}; they must be finite")
        disturbance = self._disturbance
        torque = 0.0 if disturbance is None else disturbance.torque(self._step_index)
        self.state = pitch_step(self.state, (front, rear), (torque,), self.constants, self._sine)
        self._step_index += 1
