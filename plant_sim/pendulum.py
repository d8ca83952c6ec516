"""An inverted pendulum, finer than the codec's model of it: its motor lags, and its bearing rubs.

theta'' = lambda^2 sin(theta) - d theta' - c theta' / (|theta'| + w) + g m + torque
T m' + m = u
"""

from __future__ import annotations

import math

from plant_sim.plant import PlantContext, held_command

SUBSTEPS = 4
RUB_RATE_RAD_S = 0.05
"""w: below this rate the friction of the bearing gives way."""


class PendulumPlant:
    """A `Plant` of one motor and one angle, 0 upright.

    Its constants are those of the codec's model, off by the mismatch (growth, damping, gain).
    """

    def __init__(
        self, context: PlantContext, motor_lag_s: float = 0.01, friction_rad_per_s2: float = 0.1
    ) -> None:
        if not motor_lag_s > 0.0 or not friction_rad_per_s2 >= 0.0:
            raise ValueError(
                f"motor_lag_s is {motor_lag_s} and friction_rad_per_s2 {friction_rad_per_s2}; the "
                "first must be above 0, the second at least 0"
            )
        off = context.mismatch if isinstance(context.mismatch, tuple) else (context.mismatch,) * 3
        model = context.model
        growth: float = model["growth_per_s"] * (1.0 + off[0])
        self._growth = growth * growth
        self._damping: float = model["damping_per_s"] * (1.0 + off[1])
        self._gain: float = model["torque_gain_rad_per_v_s2"] * (1.0 + off[2])
        self._friction = friction_rad_per_s2
        self._command_max = context.command_max
        self._step_s = context.step_s / SUBSTEPS
        self._left = math.exp(-self._step_s / motor_lag_s)
        self._disturbance = context.disturbance
        self._sine = context.sine
        self._state = (context.initial_angle_rad, 0.0, 0.0)
        self._steps = 0

    @property
    def measured(self) -> tuple[float, ...]:
        """The angle."""
        return self._state[:1]

    def advance(self, volts: tuple[float, ...]) -> None:
        """Hold the motor's voltage, clamped, for one step; ValueError for one that is no number."""
        (held,) = held_command(volts, self._command_max)
        disturbance = self._disturbance
        torque = 0.0 if disturbance is None else disturbance.torque(self._steps)
        self._steps += 1
        for _ in range(SUBSTEPS):
            self._substep(held, torque)

    def _substep(self, held: float, torque: float) -> None:
        theta, omega, lagging = self._state
        after = held + (lagging - held) * self._left
        push = torque + self._gain * 0.5 * (lagging + after)
        h, half = self._step_s, 0.5 * self._step_s
        k1 = self._acceleration(theta, omega, push)
        w2 = omega + half * k1
        k2 = self._acceleration(theta + half * omega, w2, push)
        w3 = omega + half * k2
        k3 = self._acceleration(theta + half * w2, w3, push)
        w4 = omega + h * k3
        k4 = self._acceleration(theta + h * w3, w4, push)
        self._state = (
            theta + h / 6.0 * (omega + 2.0 * (w2 + w3) + w4),
            omega + h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4),
            after,
        )

    def _acceleration(self, theta: float, omega: float, push: float) -> float:
        rub = self._friction * omega / (abs(omega) + RUB_RATE_RAD_S)
        return self._growth * self._sine(theta) - self._damping * omega - rub + push
