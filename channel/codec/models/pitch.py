"""The pitch axis as the codec predicts it: observer (23) with the motor filters (12).

    theta' = omega + e1
    omega' = -a_w omega - a_th sin(theta - theta_0) + k_v mu + e2,   mu = vbar_front - vbar_rear
    T_m vbar_i' + vbar_i = v_i

A command is held over a tick, so the filters are advanced exactly; angle and rate by one classical
Runge-Kutta step, with mu taken at the start, the middle and the end of the tick.
"""

from __future__ import annotations

from dataclasses import dataclass

from channel.codec.codec import Vector
from channel.codec.models.base import FunctionModel
from channel.codec.numerics import exp, sin
from channel.codec.signals import InputSignal, Signal, Signals

PITCH_SIGNALS = Signals(
    states=(
        Signal("pitch", "rad"),
        Signal("pitch_rate", "rad/s"),
        Signal("front_lagging", "V"),
        Signal("rear_lagging", "V"),
    ),
    inputs=(InputSignal("front", "V", group="motors"), InputSignal("rear", "V", group="motors")),
    outputs=(Signal("pitch", "rad"),),
    picture="helicopter",
)


@dataclass(frozen=True, slots=True)
class PitchParameters:
    """The parameters of the paper's identification. Defaults are the paper's."""

    rate_damping_per_s: float = 0.1
    """a_w"""
    stiffness_per_s2: float = 0.5
    """a_th"""
    torque_gain_rad_per_v_s2: float = 0.35
    """k_v"""
    equilibrium_rad: float = -0.115
    """theta_0, where the body rests without voltage"""
    motor_lag_s: float = 0.08
    """T_m; zero for motors that follow at once"""


def pitch_constants(parameters: PitchParameters, tick_s: float) -> Vector:
    """Return the constants of `pitch_tick` for a tick of `tick_s` seconds."""
    lag = parameters.motor_lag_s
    return (
        parameters.rate_damping_per_s,
        parameters.stiffness_per_s2,
        parameters.torque_gain_rad_per_v_s2,
        parameters.equilibrium_rad,
        tick_s,
        exp(-0.5 * tick_s / lag) if lag > 0.0 else 0.0,
        exp(-tick_s / lag) if lag > 0.0 else 0.0,
    )


def pitch_tick(state: Vector, command: Vector, held: Vector, constants: Vector) -> Vector:
    """Advance (theta, omega, vbar_front, vbar_rear) by one tick; a pure function of floats.

    `command` is (front, rear) in volts, `held` the correction (e1, e2) of angle and rate.
    """
    theta, omega, front, rear = state
    damping, stiffness, gain, equilibrium, h, decay_half, decay = constants
    front_volts, rear_volts = command
    angle_held, rate_held = held
    volts = front_volts - rear_volts
    lagging = front - rear - volts
    start = rate_held + gain * (volts + lagging)
    middle = rate_held + gain * (volts + lagging * decay_half)
    end = rate_held + gain * (volts + lagging * decay)
    half = 0.5 * h
    angle = theta - equilibrium

    angle_1 = omega + angle_held
    rate_1 = start - damping * omega - stiffness * sin(angle)
    omega_2 = omega + half * rate_1
    angle_2 = omega_2 + angle_held
    rate_2 = middle - damping * omega_2 - stiffness * sin(angle + half * angle_1)
    omega_3 = omega + half * rate_2
    angle_3 = omega_3 + angle_held
    rate_3 = middle - damping * omega_3 - stiffness * sin(angle + half * angle_2)
    omega_4 = omega + h * rate_3
    angle_4 = omega_4 + angle_held
    rate_4 = end - damping * omega_4 - stiffness * sin(angle + h * angle_3)

    sixth = h / 6.0
    return (
        theta + sixth * (angle_1 + 2.0 * (angle_2 + angle_3) + angle_4),
        omega + sixth * (rate_1 + 2.0 * (rate_2 + rate_3) + rate_4),
        front_volts + (front - front_volts) * decay,
        rear_volts + (rear - rear_volts) * decay,
    )


class PitchModel(FunctionModel):
    """Prediction model of the pitch: states (angle rad, rate rad/s, two lagging voltages V)."""

    state_size = 4
    correction_size = 2
    input_size = 2
    signals = PITCH_SIGNALS
    tick_function = staticmethod(pitch_tick)

    def __init__(self, parameters: PitchParameters, tick_s: float, start: Vector = ()) -> None:
        """`start` is the initial state; empty: the paper's, at angle zero, at rest, motors off."""
        self.parameters = parameters
        self.constants: Vector = pitch_constants(parameters, tick_s)
        self._start = start or (0.0, 0.0, 0.0, 0.0)
