"""The transmitter's observer: the whole state of the plant, from full-rate encoders.

A coder that uses rates forms its words from all corrected states. The encoders give outputs only, so
the states come from an observer at the transmitter: the codec's own model, the commands that are known
here anyway, and every measurement as a correction by constant gains,

    x <- x + L (y - y_hat)

None of it enters the codec's state, and the receiver need not know of it: the receiver sees signs only.
`rate_observer` has gains for an angle and its rate; `tenbaud.design.observer` those of a Kalman filter.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from channel.codec.codec import Codec, Model, Vector

BANDWIDTH_RAD_S = 30.0
"""About (q / r)^(1/4) for white torque of q = 2e-3 rad^2/s^3 and an encoder of 4096 counts at 10 ms."""
RATE_MAX = 1e3
"""rad/s; a body that seems faster has a broken encoder, and the observer starts anew"""

Rows = Sequence[Vector]


def seen_row(
    state: Vector, errors: Sequence[float], gains: Rows, largest: Sequence[float], row: int
) -> float:
    """Return one state after the correction by the errors of all outputs; 0 for one too large."""
    total = 0.0
    for index in range(len(errors)):
        total += gains[row][index] * errors[index]
    seen = state[row] + total
    if not -largest[row] < seen < largest[row]:
        return 0.0
    return seen


class StateObserver:
    """All corrected states at each tick, from outputs and commands.

    `gains` and `anew` have a row per state and a column per output: the correction at a tick, and the
    one after ticks that were not seen, which must make the outputs what is measured. A state beyond its
    `largest` starts at zero again.
    """

    def __init__(self, model: Model, gains: Rows, anew: Rows, largest: Vector) -> None:
        self.gains = tuple(gains)
        self.anew = tuple(anew)
        self.largest = largest
        self._model = model
        self._nothing: Vector = (0.0,) * model.correction_size
        self._state = model.initial()
        self._tick: int | None = None

    def look(self, tick: int, measurement: Vector, command: Vector) -> Vector:
        """Return the corrected states at a tick; `command` was held since the tick before.

        After a tick that was not seen the outputs start anew and the rest is kept.
        """
        state = self._state
        expected = self._tick is not None and tick == self._tick + 1
        self._tick = tick
        if expected:
            state = self._model.tick(state, command, self._nothing)
        predicted = self._model.measured(state)
        errors = tuple([seen - one for seen, one in zip(measurement, predicted, strict=True)])
        gains = self.gains if expected else self.anew
        self._state = tuple(
            [seen_row(state, errors, gains, self.largest, row) for row in range(len(state))]
        )
        return self._state[: self._model.correction_size]


def default_observer(codec: Codec, tick_s: float) -> StateObserver | None:
    """Return the observer of a codec for which none was designed; None for one that needs none."""
    return rate_observer(codec.model, tick_s) if codec.uses_rates else None


def rate_observer(
    model: Model, tick_s: float, bandwidth_rad_s: float = BANDWIDTH_RAD_S
) -> StateObserver:
    """Return the observer of an angle and its rate, the first two states of a model.

    It is the critically damped g-h filter: `1 - r^2` of an error goes to the angle, `(1 - r)^2 / h` to
    the rate, `r = exp(-bandwidth h)`. Slow hides the encoder's steps, fast catches shoves.
    """
    if not bandwidth_rad_s > 0.0:
        raise ValueError(f"bandwidth_rad_s is {bandwidth_rad_s}; it must be above 0")
    if len(model.measured(model.initial())) != 1 or model.correction_size != 2:
        raise ValueError(
            "a coder that uses rates needs a model of one measured angle whose angle and rate take "
            "corrections, or a linear model"
        )
    kept = math.exp(-bandwidth_rad_s * tick_s)
    others = model.state_size - 2
    gains = ((1.0 - kept * kept,), ((1.0 - kept) * (1.0 - kept) / tick_s,), *((0.0,),) * others)
    anew = ((1.0,), *((0.0,),) * (others + 1))
    return StateObserver(model, gains, anew, (math.inf, RATE_MAX, *(math.inf,) * others))
