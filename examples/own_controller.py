"""A controller of your own: full state feedback instead of the paper's PID law.

python examples/own_controller.py
cd examples && tenbaud demo --set receiver.controller=own_controller:StateFeedback
"""

from __future__ import annotations

from tenbaud import fly
from tenbaud.controllers import ControllerContext


class StateFeedback:
    """Pulls angle and rate to the set-point, with an integral for what the model does not know.

    It runs at the receiver only, on what one bit per sample has told it.
    """

    def __init__(
        self,
        context: ControllerContext,
        stiffness: float = 6.0,
        damping: float = 5.0,
        rest: float = 1.5,
    ) -> None:
        self.context = context
        self.stiffness = stiffness  # V/rad
        self.damping = damping  # V/(rad/s)
        self.rest_per_tick = rest * context.tick_s  # V/rad, per tick
        self.rest_volts = 0.0

    def command(self, tick: int, state: tuple[float, ...]) -> tuple[float, float]:
        """Return the voltages of front and rear motor."""
        angle_rad, rate_rad_per_s = state[:2]
        error_rad = self.context.reference.value(tick) - angle_rad
        if abs(error_rad) < 0.3:
            self.rest_volts += self.rest_per_tick * error_rad
        volts = self.stiffness * error_rad - self.damping * rate_rad_per_s + self.rest_volts
        largest = sum(self.context.command_max)
        volts = max(-largest, min(largest, volts))
        return volts / 2.0, -volts / 2.0

    def references(self, tick: int) -> tuple[float, ...]:
        """Return the set-point of each output, for the recording."""
        return (self.context.reference.value(tick),)


if __name__ == "__main__":
    for controller in ("pid", "own_controller:StateFeedback"):
        run = fly(
            "tuned-10baud",
            controller=controller,
            settings={"transmitter.plant.mismatch": 0.1, "duration_s": 75.0},
        )
        print(f"{controller:32} tracking rms {run.summary['tracking_rms_rad']:.3f} rad")
