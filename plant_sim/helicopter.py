"""A helicopter on an arm, three axes and two rotors: travel l, elevation e, pitch p.

l'' = -c_l l' - b_l cos(e) sin(p) f_s
e'' = -a_1 sin(e) - a_2 sin(e) cos(p) - c_e e' + b_e cos(p) f_s
p'' = -a_p cos(e) sin(p) - c_p p' + b_p f_d

f_s and f_d are sum and difference of the rotors' forces, each a function of its voltage that is weaker
and smaller downward (`force_of`). Parameters and force of the rig `laas` are those of the benchmark of
Brentari, Bosetti, Queinnec and Zaccarian (2018, hal-01711135), those of `ctu` of a Quanser 3-DOF
helicopter (obrusvit/quanser-3dof-heli); both were measured. The motors' lag is that of the paper's
pitch axis. Beyond its mechanical range an axis meets a stiff, damped stop. Without thrust the arm is
level at rest.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from plant_sim.disturbance import Sum
from plant_sim.moving_mass import MovingMass
from plant_sim.ode import HALF_PI, OdePlant, Sine, Vector, fractions, started
from plant_sim.plant import PlantContext

HOVER_RAD = math.radians(10.0)
PITCH_STOP_RAD = math.radians(32.0)
ELEVATION_STOPS_RAD = (math.radians(-28.0), math.radians(30.0))
STOP_STIFFNESS_PER_S2, STOP_DAMPING_PER_S = 400.0, 20.0
MASS_RAD_PER_S2_PER_M, PULL_MOST = 4.0, 1e6


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
    up_per_v2: float = 0.1111
    """force of a rotor at 1 V; it grows with the square up to a voltage, in proportion beyond"""
    up_from_v: float = 1.0
    down_per_v2: float = 4.0 * 0.012054
    down_from_v: float = 0.5
    travel_stop_rad: float = math.pi
    """to either side of where travel began to be counted"""


LAAS = HelicopterConstants()
RIGS = {
    "laas": LAAS,
    "ctu": HelicopterConstants(
        2.7e-7, 0.181, 0.898, 0.262, 0.042, 0.247, 0.030, 0.037, 2.326, 4.0 * 0.002541, 1e3,
        4.0 * 0.000975, 1e3,
    ),
}  # fmt: skip


def force_of(volts: float, constants: HelicopterConstants = LAAS) -> float:
    """Return the scaled force of a rotor; on the rig `laas` 1 at 5 V, -0.23 at -5 V."""
    if volts >= 0.0:
        return _grown(volts, constants.up_per_v2, constants.up_from_v)
    return -_grown(-volts, constants.down_per_v2, constants.down_from_v)


def _grown(size: float, per_v2: float, from_v: float) -> float:
    return per_v2 * size * size if size < from_v else per_v2 * from_v * (2.0 * size - from_v)


def volts_of(force: float, constants: HelicopterConstants = LAAS) -> float:
    """Return the voltage at which a rotor has this force upward."""
    square, start = force / constants.up_per_v2, constants.up_from_v
    return math.sqrt(square) if square < start * start else 0.5 * (square / start + start)


def helicopter_slopes(
    state: Vector, motors: Vector, torques: Vector, constants: HelicopterConstants, sine: Sine
) -> Vector:
    """Return the rates and accelerations of travel, elevation and pitch."""
    elevation, pitch = state[1], state[2]
    travel_rate, elevation_rate, pitch_rate = state[3], state[4], state[5]
    front, rear = force_of(motors[0], constants), force_of(motors[1], constants)
    lift = front + rear
    sin_e, cos_e = sine(elevation), sine(elevation + HALF_PI)
    sin_p, cos_p = sine(pitch), sine(pitch + HALF_PI)
    return (
        travel_rate,
        elevation_rate,
        pitch_rate,
        torques[0]
        - constants.travel_damping * travel_rate
        - constants.travel_thrust * cos_e * sin_p * lift
        + _stop(state[0], travel_rate, -constants.travel_stop_rad, constants.travel_stop_rad),
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

    It hovers at the start, at 10 degrees of elevation if not configured otherwise; at 0 its rotors are
    off. The mismatch is of damping, weight and thrust. Every axis is disturbed.
    """

    def __init__(
        self,
        context: PlantContext,
        motor_lag_s: float = 0.08,
        rig: str = "laas",
        travel_stop_rad: float | None = None,
        mass_rad_per_s2_per_m: float | None = None,
        mass_moves: Sequence[Sequence[float]] = (),
    ) -> None:
        """`rig`: whose parameters it has, `laas` or `ctu`.

        `travel_stop_rad` is that of the codec's model if not given, half a turn where it has none.
        `mass_moves` are (time in s, position in m) of the mass that moves along the arm, from its home
        outward; a metre of it pulls the elevation down by `mass_rad_per_s2_per_m`, 4 if not given.
        """
        if rig not in RIGS:
            raise ValueError(f"rig is {rig!r}; known are {', '.join(RIGS)}")
        if travel_stop_rad is None:
            travel_stop_rad = float(context.model.get("travel_stop_rad", LAAS.travel_stop_rad))
        if not 0.0 < travel_stop_rad < math.inf:
            raise ValueError(f"travel_stop_rad is {travel_stop_rad}; it must be finite and above 0")
        damping, weight, thrust = fractions(context)
        off = {"damping": damping, "weight": weight, "tilt": weight, "thrust": thrust}
        nominal = RIGS[rig]._replace(travel_stop_rad=travel_stop_rad)
        constants = HelicopterConstants(
            **{
                name: value * (1.0 + off.get(name.rpartition("_")[2], 0.0))
                for name, value in nominal._asdict().items()
            }
        )
        outputs = started(context, (0.0, HOVER_RAD, 0.0))
        elevation = nominal.elevation_weight + nominal.elevation_tilt
        force = 0.5 * elevation * max(math.sin(outputs[1]), 0.0) / nominal.elevation_thrust
        hover = volts_of(force, nominal)
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
        if mass_moves:
            mass = MovingMass(mass_moves, -_pull_of(mass_rad_per_s2_per_m), context.step_s)
            travel, elevated, pitch = self._disturbances or (Sum(), Sum(), Sum())
            self._disturbances = (travel, Sum(elevated, mass), pitch)
        elif mass_rad_per_s2_per_m is not None:
            raise ValueError("mass_rad_per_s2_per_m is given, and no mass moves: give mass_moves too")


def _pull_of(given: float | None) -> float:
    pull = MASS_RAD_PER_S2_PER_M if given is None else given
    if not 0.0 <= pull <= PULL_MOST:
        raise ValueError(
            f"mass_rad_per_s2_per_m is {pull}; it must be at least 0 and at most {PULL_MOST:g}"
        )
    return pull
