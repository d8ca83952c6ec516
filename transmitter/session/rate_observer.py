"""The transmitter's rate observer: the rate of the body, from the full-rate encoder.

A coder that uses rates forms its words from angle and rate. The encoder gives counts only, so the rate
comes from a small observer at the transmitter: the codec's own model, the commands that are known here
anyway, and every count as a correction,

    angle <- angle + (1 - r^2) e,     rate <- rate + (1 - r)^2 / h e,     r = exp(-bandwidth h)

with `e` the count's angle less the predicted one (the critically damped g-h filter). None of it enters
the codec's state, and the receiver need not know of it: the receiver sees its sign only.
"""

from __future__ import annotations

import math

from channel.codec.codec import Model, Vector

BANDWIDTH_RAD_S = 30.0
"""About (q / r)^(1/4) for white torque of q = 2e-3 rad^2/s^3 and an encoder of 4096 counts at 10 ms."""
RATE_MAX = 1e3
"""rad/s; a body that seems faster has a broken encoder, and the observer starts anew"""


class RateObserver:
    """Angle and rate at each tick, from angles and commands. Serves one measured axis.

    `bandwidth_rad_s`: how fast it follows; slow hides the encoder's steps, fast catches shoves.
    """

    def __init__(self, model: Model, tick_s: float, bandwidth_rad_s: float = BANDWIDTH_RAD_S) -> None:
        if not bandwidth_rad_s > 0.0:
            raise ValueError(f"bandwidth_rad_s is {bandwidth_rad_s}; it must be above 0")
        if len(model.measured(model.initial())) != 1 or model.correction_size != 2:
            raise ValueError(
                "a coder that uses rates needs a model of one measured angle whose angle and rate take "
                "corrections"
            )
        self._model = model
        kept = math.exp(-bandwidth_rad_s * tick_s)
        self._angle_share = 1.0 - kept * kept
        self._rate_per_s = (1.0 - kept) * (1.0 - kept) / tick_s
        self._nothing: Vector = (0.0,) * model.correction_size
        self._state = model.initial()
        self._tick: int | None = None

    def look(self, tick: int, measurement: Vector, command: Vector) -> Vector:
        """Return (angle, rate) at a tick; `command` is the one that was held since the tick before.

        After a tick that was not seen the angle starts anew and the rate is kept.
        """
        state = self._state
        expected = self._tick is not None and tick == self._tick + 1
        self._tick = tick
        if expected:
            state = self._model.tick(state, command, self._nothing)
        else:
            state = (measurement[0], *state[1:])
        error = measurement[0] - state[0]
        rate = state[1] + self._rate_per_s * error
        if not -RATE_MAX < rate < RATE_MAX:
            rate = 0.0
        self._state = (state[0] + self._angle_share * error, rate, *state[2:])
        return self._state[:2]
