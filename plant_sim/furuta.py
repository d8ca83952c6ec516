"""A rotary inverted pendulum (Furuta): an arm that a motor turns, a rod at its end, 0 upright.

(a + b sin^2 p) r'' - c cos(p) p'' + 2 b sin(p) cos(p) r' p' + c sin(p) p'^2 = torque - D_r r' - rub
-c cos(p) r'' + d p'' - b sin(p) cos(p) r'^2 - e sin(p) = -D_p p'
torque = k (u - k r') / R

r is the arm's angle and p the rod's. The parameters are those of the Quanser QUBE-Servo: a rod of 24 g
and 129 mm on an arm of 95 g and 85 mm, k = 0.042 N m/A, R = 8.4 ohm. The bearing's dry friction (`rub`)
is beside the codec's model, which is the rest of this near upright.
"""

from __future__ import annotations

from typing import NamedTuple

from plant_sim.ode import (
    HALF_PI,
    OdePlant,
    Sine,
    Vector,
    fractions,
    require_at_least_zero,
    rub,
    started,
)
from plant_sim.plant import PlantContext

GRAVITY_M_S2 = 9.81
ROD_KG, ROD_M = 0.024, 0.129
ARM_KG, ARM_M = 0.095, 0.085
MOTOR_N_M_PER_A, WINDING_OHM = 0.042, 8.4
ROD_SHOVE = 10.0
"""rad/s^2 of the rod per unit of the second disturbance"""
RUB_RATE_RAD_S = 0.2


class FurutaConstants(NamedTuple):
    """Constants of the equations; inertias in kg m^2."""

    a: float
    b: float
    c: float
    d: float
    e: float
    """N m"""
    arm_damping: float
    """N m s/rad, of bearing and motor"""
    rod_damping: float
    friction: float
    """N m"""
    torque_per_volt: float


def furuta_slopes(
    state: Vector, motors: Vector, torques: Vector, constants: FurutaConstants, sine: Sine
) -> Vector:
    """Return the rates and accelerations of arm and rod; torques are volts and `ROD_SHOVE`s."""
    rod, arm_rate, rod_rate = state[1], state[2], state[3]
    sin, cos = sine(rod), sine(rod + HALF_PI)
    volts = motors[0] + torques[0]
    arm = (
        constants.torque_per_volt * volts
        - constants.arm_damping * arm_rate
        - rub(arm_rate, constants.friction, RUB_RATE_RAD_S)
        - 2.0 * constants.b * sin * cos * arm_rate * rod_rate
        - constants.c * sin * rod_rate * rod_rate
    )
    tip = (
        constants.e * sin
        - constants.rod_damping * rod_rate
        + constants.b * sin * cos * arm_rate * arm_rate
    )
    about_arm = constants.a + constants.b * sin * sin
    across = constants.c * cos
    share = 1.0 / (about_arm * constants.d - across * across)
    return (
        arm_rate,
        rod_rate,
        share * (constants.d * arm + across * tip),
        share * (across * arm + about_arm * tip) + ROD_SHOVE * torques[1],
    )


class FurutaPlant(OdePlant):
    """A `Plant` of one voltage and two angles, arm and rod.

    The mismatch is of damping, gravity and torque. It is disturbed at the motor (V) and at the rod.
    """

    def __init__(
        self,
        context: PlantContext,
        arm_damping: float = 1.04e-6,
        rod_damping: float = 5e-6,
        friction: float = 1e-4,
    ) -> None:
        require_at_least_zero(arm_damping=arm_damping, rod_damping=rod_damping, friction=friction)
        damping, gravity, gain = fractions(context)
        per_volt = MOTOR_N_M_PER_A / WINDING_OHM
        constants = FurutaConstants(
            a=ARM_KG * ARM_M**2 / 12.0 + ROD_KG * ARM_M**2,
            b=ROD_KG * ROD_M**2 / 4.0,
            c=ROD_KG * ROD_M * ARM_M / 2.0,
            d=ROD_KG * ROD_M**2 / 3.0,
            e=ROD_KG * ROD_M * GRAVITY_M_S2 / 2.0 * (1.0 + gravity),
            arm_damping=(arm_damping + per_volt * MOTOR_N_M_PER_A) * (1.0 + damping),
            rod_damping=rod_damping * (1.0 + damping),
            friction=friction,
            torque_per_volt=per_volt * (1.0 + gain),
        )
        start = (*started(context, (0.0, 0.0)), 0.0, 0.0)
        super().__init__(context, furuta_slopes, constants, start, outputs=2, places=2)
