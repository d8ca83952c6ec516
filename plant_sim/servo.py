"""A DC motor with an encoder, finer than the codec's model of it: the winding lags, the bearing rubs.

T speed' = k m - speed - T c speed / (|speed| + w) + T torque
"""

from __future__ import annotations

from plant_sim.ode import OdePlant, Sine, Vector, fractions, require_at_least_zero, rub, started
from plant_sim.plant import PlantContext

RUB_RATE_RAD_S = 0.05
"""w: below this speed the friction of the bearing gives way."""


def servo_slopes(
    state: Vector, motors: Vector, torques: Vector, constants: Vector, sine: Sine
) -> Vector:
    """Return speed and acceleration; constants are 1 / T, k / T and c."""
    speed = state[1]
    rubbing = rub(speed, constants[2], RUB_RATE_RAD_S)
    return (speed, constants[1] * motors[0] - constants[0] * speed - rubbing + torques[0])


class ServoPlant(OdePlant):
    """A `Plant` of one voltage and one angle.

    The mismatch is of 1 / T (damping) and k / T (gain).
    """

    def __init__(
        self,
        context: PlantContext,
        time_constant_s: float = 0.1,
        gain_rad_per_v_s: float = 1.0,
        winding_lag_s: float = 0.002,
        friction_rad_per_s2: float = 0.5,
    ) -> None:
        require_at_least_zero(friction_rad_per_s2=friction_rad_per_s2, winding_lag_s=winding_lag_s)
        if not time_constant_s > 0.0:
            raise ValueError(f"time_constant_s is {time_constant_s}; it must be above 0")
        damping, _, gain = fractions(context)
        pole = 1.0 / time_constant_s
        constants = (
            pole * (1.0 + damping),
            gain_rad_per_v_s * pole * (1.0 + gain),
            friction_rad_per_s2,
        )
        start = (*started(context, (0.0,)), 0.0)
        super().__init__(context, servo_slopes, constants, start, motor_lag_s=winding_lag_s)
