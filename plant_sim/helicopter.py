"""A helicopter on an arm, three axes and two rotors: travel l, elevation e, pitch p.

l'' = -c_l l' - b_l cos(e) sin(p) f_s
e'' = -a_1 sin(e) - a_2 sin(e) cos(p) - c_e e' + b_e cos(p) f_s
p'' = -a_p cos(e) sin(p) - c_p p' + b_p f_d

f_s and f_d are sum and difference of the rotors' forces, each a function of its voltage that is weaker
and smaller downward (`force_of`). Parameters and force are those of the benchmark of Brentari, Bosetti,
Queinnec and Zaccarian (2018, hal-01711135), measured on a rig. The motors' lag is that of the paper's
pitch axis. Beyond its mechanical range an axis meets a stiff, damped stop.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from plant_sim.ode import HALF_PI, OdePlant, Sine, Vector, fractions, started
from plant_sim.plant import PlantContext

HOVER_RAD = math.radians(10.0)
PITCH_STOP_RAD = math.radians(32.0)
ELEVATION_STOPS_RAD = (math.radians(-28.0), math.radians(30.0))
STOP_STIFFNESS_PER_S2, STOP_DAMPING_PER_S = 400.0, 20.0
UP, UP_FROM = 0.1111, 1.0
"""force at the voltage from which it grows in proportion; below it grows with the square"""
DOWN, DOWN_FROM = 0.012054, 0.5


class HelicopterConstants(NamedTuple):
    """Parameters of the equations."""

    travel_damping: float = 0.273724
    travel_thrust: float = 0.257485
    elevation_weight: float = 2.355588
    elevation_tilt: float = 0.798994
    elevation_damping: float = 0.053735
    elevation_thrust: float = 0.564962
    pitch_weight: float = 0.858663
    pitch_damping: float = 0.048169
    pitch_thrust: float = 7.339993


def force_of(volts: float) -> float:
    """Return the scaled force of a rotor: 1 at 5 V, -0.23 at -5 V."""
    if volts >= 0.0:
        return UP * volts * volts if volts < UP_FROM else UP * (2.0 * volts - 1.0)
    size = -volts
    force = 4.0 * DOWN * size * size if size < DOWN_FROM else DOWN * (4.0 * size - 1.0)
    return -force


def volts_of(force: float) -> float:
    """Return the voltage at which a rotor has this force upward."""
    return math.sqrt(force / UP) if force < UP else 0.5 * (force / UP + 1.0)


def helicopter_slopes(
    state: Vector, motors: Vector, torques: Vector, constants: HelicopterConstants, sine: Sine
) -> Vector:
    """Return the rates and accelerations of travel, elevation and pitch."""
    elevation, pitch = state[1], state[2]
    travel_rate, elevation_rate, pitch_rate = state[3], state[4], state[5]
    front, rear = force_of(motors[0]), force_of(motors[1])
    lift = front + rear
    sin_e, cos_e = sine(elevation), sine(elevation + HALF_PI)
    sin_p, cos_p = sine(pitch), sine(pitch + HALF_PI)
    return (
        travel_rate,
        elevation_rate,
        pitch_rate,
        torques[0]
        - constants.travel_damping * travel_rate
        - constants.travel_thrust * cos_e * sin_p * lift,
        torques[1]
        - sin_e * (constants.elevation_weight + constants.elevation_tilt * cos_p)
        - constants.elevation_damping * elevation_rate
        + constants.elevation_thrust * cos_p * lift
        + _stop(elevation, elevation_rate, ELEVATION_STOPS_RAD[0], ELEVATION_STOPS_RAD[1]),
        torques[2]
        - constants.pitch_weight * cos_e * sin_p
        - constants.pitch_damping * pitch_rate
        + constants.pitch_thrust * (front - rear)
        + _stop(pitch, pitch_rate, -PITCH_STOP_RAD, PITCH_STOP_RAD),
    )


def _stop(angle: float, rate: float, low: float, high: float) -> float:
    if low <= angle <= high:
        return 0.0
    beyond = angle - (high if angle > high else low)
    return -STOP_STIFFNESS_PER_S2 * beyond - STOP_DAMPING_PER_S * rate


class HelicopterPlant(OdePlant):
    """A `Plant` of two voltages, front and rear, and three angles.

    It hovers at the start, at 10 degrees of elevation if not configured otherwise. The mismatch is of
    damping, weight and thrust. Every axis is disturbed.
    """

    def __init__(self, context: PlantContext, motor_lag_s: float = 0.08) -> None:
        damping, weight, thrust = fractions(context)
        off = {"damping": damping, "weight": weight, "tilt": weight, "thrust": thrust}
        nominal = HelicopterConstants()
        constants = HelicopterConstants(
            **{
                name: value * (1.0 + off[name.rpartition("_")[2]])
                for name, value in nominal._asdict().items()
            }
        )
        outputs = started(context, (0.0, HOVER_RAD, 0.0))
        elevation = nominal.elevation_weight + nominal.elevation_tilt
        hover = volts_of(0.5 * elevation * max(math.sin(outputs[1]), 0.0) / nominal.elevation_thrust)
        super().__init__(
            context,
            helicopter_slopes,
            constants,
            (*outputs, 0.0, 0.0, 0.0),
            outputs=3,
            places=3,
            motor_lag_s=motor_lag_s,
            resting=(hover, hover),
        )
