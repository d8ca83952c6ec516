"""An inverted pendulum, finer than the codec's model of it: its motor lags, and its bearing rubs.

theta'' = lambda^2 sin(theta) - d theta' - c theta' / (|theta'| + w) + g m + torque
"""

from __future__ import annotations

from plant_sim.ode import OdePlant, Sine, Vector, fractions, require_at_least_zero, rub, started
from plant_sim.plant import PlantContext

RUB_RATE_RAD_S = 0.05
"""w: below this rate the friction of the bearing gives way."""


def pendulum_slopes(
    state: Vector, motors: Vector, torques: Vector, constants: Vector, sine: Sine
) -> Vector:
    """Return rate and acceleration; constants are lambda^2, d, g and c."""
    growth, damping, gain, friction = constants[0], constants[1], constants[2], constants[3]
    omega = state[1]
    push = torques[0] + gain * motors[0]
    rubbing = rub(omega, friction, RUB_RATE_RAD_S)
    return (omega, growth * sine(state[0]) - damping * omega - rubbing + push)


class PendulumPlant(OdePlant):
    """A `Plant` of one motor and one angle, 0 upright.

    Its constants are those of the codec's model, off by the mismatch (growth, damping, gain).
    """

    def __init__(
        self, context: PlantContext, motor_lag_s: float = 0.01, friction_rad_per_s2: float = 0.1
    ) -> None:
        require_at_least_zero(friction_rad_per_s2=friction_rad_per_s2)
        model, off = context.model, fractions(context)
        growth = model["growth_per_s"] * (1.0 + off[0])
        constants = (
            growth * growth,
            model["damping_per_s"] * (1.0 + off[1]),
            model["torque_gain_rad_per_v_s2"] * (1.0 + off[2]),
            friction_rad_per_s2,
        )
        start = (*started(context, (0.0,)), 0.0)
        super().__init__(context, pendulum_slopes, constants, start, motor_lag_s=motor_lag_s)
