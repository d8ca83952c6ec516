"""An inverted pendulum as the codec predicts it: unstable, one angle, one motor.

    theta' = omega + e1
    omega' = lambda^2 sin(theta) - d omega + g u + e2

The angle is 0 upright. Its errors grow by exp(lambda) a second, so that no code of fewer than
lambda / ln 2 bits a second can hold it: 10.56 for the 7.32 1/s of Khojasteh et al.
"""

from __future__ import annotations

from channel.codec.codec import ModelContext, Vector
from channel.codec.models.base import FunctionModel
from channel.codec.numerics import sin
from channel.codec.signals import InputSignal, Signal, Signals

PENDULUM_SIGNALS = Signals(
    states=(Signal("angle", "rad"), Signal("angle_rate", "rad/s")),
    inputs=(InputSignal("motor", "V", -10.0, 10.0),),
    outputs=(Signal("angle", "rad", -1.0, 1.0),),
    picture="pendulum",
)


def pendulum_tick(state: Vector, command: Vector, held: Vector, constants: Vector) -> Vector:
    """Advance (theta, omega) by one Runge-Kutta step; `command` is (motor,) in V."""
    theta, omega = state
    growth, damping, gain, h = constants
    push = held[1] + gain * command[0]
    drift = held[0]
    half = 0.5 * h
    angle_1 = omega + drift
    rate_1 = push + growth * sin(theta) - damping * omega
    omega_2 = omega + half * rate_1
    angle_2 = omega_2 + drift
    rate_2 = push + growth * sin(theta + half * angle_1) - damping * omega_2
    omega_3 = omega + half * rate_2
    angle_3 = omega_3 + drift
    rate_3 = push + growth * sin(theta + half * angle_2) - damping * omega_3
    omega_4 = omega + h * rate_3
    angle_4 = omega_4 + drift
    rate_4 = push + growth * sin(theta + h * angle_3) - damping * omega_4
    sixth = h / 6.0
    return (
        theta + sixth * (angle_1 + 2.0 * (angle_2 + angle_3) + angle_4),
        omega + sixth * (rate_1 + 2.0 * (rate_2 + rate_3) + rate_4),
    )


class PendulumModel(FunctionModel):
    """An inverted pendulum, upright at angle 0, pushed by one motor."""

    state_size = 2
    correction_size = 2
    input_size = 1
    signals = PENDULUM_SIGNALS
    tick_function = staticmethod(pendulum_tick)

    def __init__(
        self,
        context: ModelContext,
        growth_per_s: float = 7.32,
        damping_per_s: float = 0.1,
        torque_gain_rad_per_v_s2: float = 4.0,
        start: Vector = (),
    ) -> None:
        """`start` is the initial state; empty: upright and at rest."""
        growth = growth_per_s * growth_per_s
        self.constants: Vector = (growth, damping_per_s, torque_gain_rad_per_v_s2, context.tick_s)
        self._start = start or (0.0, 0.0)
