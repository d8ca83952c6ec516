"""A helicopter on an arm as the codec predicts it: travel l, elevation e and pitch p, two rotors.

    l'' = -c_l l' - b_l cos(e) sin(p) f_s
    e'' = -a_1 sin(e) - a_2 sin(e) cos(p) - c_e e' + b_e cos(p) f_s
    p'' = -a_p cos(e) sin(p) - c_p p' + b_p f_d
    T_m vbar_i' + vbar_i = v_i

f_s and f_d are sum and difference of the rotors' forces; a force grows with the square of a small
voltage and in proportion to a larger one, and is weaker downward (`force_of`). Beyond its range an
axis meets a stiff, damped stop. A command is held over a tick, so the motors are advanced exactly; the
arm by one classical Runge-Kutta step.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from channel.codec.codec import Vector
from channel.codec.models.base import FunctionModel
from channel.codec.numerics import cos, exp, sin
from channel.codec.signals import InputSignal, Signal, Signals

AXES = ("travel", "elevation", "pitch")
HELICOPTER_SIGNALS = Signals(
    states=(
        *[Signal(axis, "rad") for axis in AXES],
        *[Signal(f"{axis}_rate", "rad/s") for axis in AXES],
        Signal("front_lagging", "V"),
        Signal("rear_lagging", "V"),
    ),
    inputs=(InputSignal("front", "V", group="motors"), InputSignal("rear", "V", group="motors")),
    outputs=tuple([Signal(axis, "rad") for axis in AXES]),
    picture="helicopter",
)
LINEAR_UP_V, LINEAR_DOWN_V = 1.0, 0.5
"""voltages from which a rotor's force grows in proportion"""
STOP_STIFFNESS_PER_S2, STOP_DAMPING_PER_S = 400.0, 20.0


class HelicopterParameters(NamedTuple):
    """Parameters of the equations; a thrust is the acceleration by a force of 1."""

    travel_damping_per_s: float
    """c_l"""
    travel_thrust_rad_per_s2: float
    """b_l"""
    elevation_weight_rad_per_s2: float
    """a_1"""
    elevation_tilt_rad_per_s2: float
    """a_2"""
    elevation_damping_per_s: float
    """c_e"""
    elevation_thrust_rad_per_s2: float
    """b_e"""
    pitch_weight_rad_per_s2: float
    """a_p"""
    pitch_damping_per_s: float
    """c_p"""
    pitch_thrust_rad_per_s2: float
    """b_p"""
    force_up: float
    """of a rotor at 1 V"""
    force_down: float
    """of a rotor at -0.5 V, without its sign"""
    elevation_low_rad: float
    elevation_high_rad: float
    pitch_stop_rad: float
    travel_stop_rad: float


class HelicopterConstants(NamedTuple):
    """Constants of `helicopter_tick`."""

    equations: HelicopterParameters
    tick_s: float
    left_half: float
    left_whole: float
    """share of a motor's lag that is left after half a tick and after a whole one"""


def force_of(volts: float, up: float, down: float) -> float:
    """Return the force of a rotor."""
    if volts >= 0.0:
        return up * volts * volts if volts < LINEAR_UP_V else up * (2.0 * volts - LINEAR_UP_V)
    if volts > -LINEAR_DOWN_V:
        return -4.0 * down * volts * volts
    return down * (4.0 * volts + 1.0)


def volts_of(force: float, up: float) -> float:
    """Return the voltage at which a rotor has a force of at least 0."""
    share = force / up
    return math.sqrt(share) if share < 1.0 else 0.5 * (share + 1.0)


def stop_of(angle: float, rate: float, low: float, high: float) -> float:
    """Return how hard a stop pushes."""
    if low <= angle <= high:
        return 0.0
    beyond = angle - high if angle > high else angle - low
    return -STOP_STIFFNESS_PER_S2 * beyond - STOP_DAMPING_PER_S * rate


def slopes(
    state: Vector, front_volts: float, rear_volts: float, held: Vector, p: HelicopterParameters
) -> Vector:
    """Return the derivatives of the first six states."""
    front = force_of(front_volts, p.force_up, p.force_down)
    rear = force_of(rear_volts, p.force_up, p.force_down)
    lift = front + rear
    travel_rate, elevation_rate, pitch_rate = state[3], state[4], state[5]
    sin_e, cos_e = sin(state[1]), cos(state[1])
    sin_p, cos_p = sin(state[2]), cos(state[2])
    return (
        travel_rate + held[0],
        elevation_rate + held[1],
        pitch_rate + held[2],
        held[3]
        - p.travel_damping_per_s * travel_rate
        - p.travel_thrust_rad_per_s2 * cos_e * sin_p * lift
        + stop_of(state[0], travel_rate, -p.travel_stop_rad, p.travel_stop_rad),
        held[4]
        - sin_e * (p.elevation_weight_rad_per_s2 + p.elevation_tilt_rad_per_s2 * cos_p)
        - p.elevation_damping_per_s * elevation_rate
        + p.elevation_thrust_rad_per_s2 * cos_p * lift
        + stop_of(state[1], elevation_rate, p.elevation_low_rad, p.elevation_high_rad),
        held[5]
        - p.pitch_weight_rad_per_s2 * cos_e * sin_p
        - p.pitch_damping_per_s * pitch_rate
        + p.pitch_thrust_rad_per_s2 * (front - rear)
        + stop_of(state[2], pitch_rate, -p.pitch_stop_rad, p.pitch_stop_rad),
    )


def moved(state: Vector, slope: Vector, by_s: float) -> Vector:
    """Return the first six states after a straight step."""
    return (
        state[0] + by_s * slope[0],
        state[1] + by_s * slope[1],
        state[2] + by_s * slope[2],
        state[3] + by_s * slope[3],
        state[4] + by_s * slope[4],
        state[5] + by_s * slope[5],
    )


def helicopter_tick(
    state: Vector, command: Vector, held: Vector, constants: HelicopterConstants
) -> Vector:
    """Advance three angles, three rates and two lagging voltages by one tick.

    `command` is (front, rear) in V; `held` has a correction for each angle and rate.
    """
    p, h = constants.equations, constants.tick_s
    front, rear = command[0], command[1]
    front_left, rear_left = state[6] - front, state[7] - rear
    front_middle = front + front_left * constants.left_half
    rear_middle = rear + rear_left * constants.left_half
    front_after = front + front_left * constants.left_whole
    rear_after = rear + rear_left * constants.left_whole
    begin = (state[0], state[1], state[2], state[3], state[4], state[5])
    half, sixth = 0.5 * h, h / 6.0
    k1 = slopes(begin, front + front_left, rear + rear_left, held, p)
    k2 = slopes(moved(begin, k1, half), front_middle, rear_middle, held, p)
    k3 = slopes(moved(begin, k2, half), front_middle, rear_middle, held, p)
    k4 = slopes(moved(begin, k3, h), front_after, rear_after, held, p)
    return (
        begin[0] + sixth * (k1[0] + 2.0 * (k2[0] + k3[0]) + k4[0]),
        begin[1] + sixth * (k1[1] + 2.0 * (k2[1] + k3[1]) + k4[1]),
        begin[2] + sixth * (k1[2] + 2.0 * (k2[2] + k3[2]) + k4[2]),
        begin[3] + sixth * (k1[3] + 2.0 * (k2[3] + k3[3]) + k4[3]),
        begin[4] + sixth * (k1[4] + 2.0 * (k2[4] + k3[4]) + k4[4]),
        begin[5] + sixth * (k1[5] + 2.0 * (k2[5] + k3[5]) + k4[5]),
        front_after,
        rear_after,
    )


class HelicopterModel(FunctionModel):
    """Three angles and two rotors."""

    state_size = 8
    correction_size = 6
    input_size = 2
    signals = HELICOPTER_SIGNALS
    tick_function = staticmethod(helicopter_tick)

    def __init__(
        self,
        parameters: HelicopterParameters,
        hover_rad: float,
        motor_lag_s: float,
        tick_s: float,
        start: Vector = (),
    ) -> None:
        """`start` is the initial state; empty: the hover."""
        volts = hover_volts(parameters, hover_rad)
        hover = (0.0, hover_rad, 0.0, 0.0, 0.0, 0.0, volts, volts)
        self._start = start or hover
        self.operating = (hover, (volts, volts)) if start else None
        """state and command about which a law is designed; None: those at the start"""
        left_half = exp(-0.5 * tick_s / motor_lag_s) if motor_lag_s > 0.0 else 0.0
        left_whole = exp(-tick_s / motor_lag_s) if motor_lag_s > 0.0 else 0.0
        self.constants = HelicopterConstants(parameters, tick_s, left_half, left_whole)


def hover_volts(parameters: HelicopterParameters, elevation_rad: float) -> float:
    """Return the voltage of each rotor that holds an elevation."""
    weight = parameters.elevation_weight_rad_per_s2 + parameters.elevation_tilt_rad_per_s2
    force = 0.5 * weight * sin(elevation_rad) / parameters.elevation_thrust_rad_per_s2
    return volts_of(force, parameters.force_up)
