"""Detects a stuck encoder: counts that stay constant while the model predicts a motion.

Standing still proves nothing by itself, a body at its set-point does too. So the codec's model is
carried on from its estimate, without corrections, under the voltages that were applied; only when it
says that the body has moved far, and not one count has changed, is the encoder taken for stuck.
"""

from __future__ import annotations

from collections import deque

from channel.codec.codec import Codec, Model, Vector
from channel.codec.signals import Signal, signals_of

MOTION_RAD = 1.0
"""Predicted motion that a standing encoder contradicts. Prediction from an estimate 10 % off the
plant errs by about 0.1 rad in the window, full voltage moves the body 1.75 rad."""

WINDOW_S = 1.0
GROWTH_MAX = 5.0
"""By how much an error of the estimate may grow in a window: it is shorter for an unstable plant."""
DISTURBED = 1e-6
RANGE_SHARE = 0.25
"""Motion of an output that is no angle, as a share of its range; without a range it is not watched."""


class EncoderWatch:
    """Watches every output; costs next to nothing while their counts change."""

    def __init__(self, codec: Codec, tick_s: float) -> None:
        self._model = codec.model
        self._nothing_held = codec.nothing_held
        self._outputs = signals_of(codec.model).outputs
        self._motions = [motion_of(output) for output in self._outputs]
        self._window_ticks = window_ticks(codec.model, tick_s)
        self._counts: tuple[int, ...] = ()
        self._still_ticks: list[int] = []
        self._start: Vector = ()
        self._state: Vector = ()
        self._age_ticks = 0
        """of the window"""
        self._applied: deque[Vector] = deque()
        """voltages of its ticks that the model has not been carried over yet"""

    def check(self, counts: tuple[int, ...], applied: Vector, estimate: Vector | None) -> str | None:
        """Take one tick; return what is wrong, or None.

        `applied` are the voltages of the tick, `estimate` the model state to start a window from;
        None: there is none that could be relied on.
        """
        before, self._counts = self._counts, counts
        if len(before) != len(counts):
            self._still_ticks = [0] * len(counts)
            return None
        still = False
        for axis, count in enumerate(counts):
            same = count == before[axis]
            self._still_ticks[axis] = self._still_ticks[axis] + 1 if same else 0
            still |= same
        if not still:
            self._age_ticks = 0
            return None
        if self._age_ticks == 0:
            if estimate is None:
                return None
            self._start = self._state = estimate
            self._applied.clear()
        self._age_ticks += 1
        self._applied.append(applied)
        # Most windows end after a few ticks. The model is carried along in the second half only, two
        # ticks at a time, so that no tick has much to do.
        if 2 * self._age_ticks > self._window_ticks:
            for _ in range(min(2, len(self._applied))):
                volts = self._applied.popleft()
                try:
                    self._state = self._model.tick(self._state, volts, self._nothing_held)
                except (ArithmeticError, ValueError):  # beyond the model's validity
                    self._age_ticks = 0
                    return None
        if self._age_ticks < self._window_ticks:
            return None
        self._age_ticks = 0
        return self._judge(counts)

    def _judge(self, counts: tuple[int, ...]) -> str | None:
        """Compare, at the end of a window, the model's prediction with axes that never changed."""
        start, end = self._model.measured(self._start), self._model.measured(self._state)
        for axis, ticks in enumerate(self._still_ticks):
            moved, motion = end[axis] - start[axis], self._motions[axis]
            if ticks >= self._window_ticks and not -motion < moved < motion:
                output = self._outputs[axis]
                return (
                    f"the encoder of {output.name} stood at {counts[axis]} counts for {ticks} ticks in "
                    f"which it should have moved by {moved:.2f} {output.unit}: it is stuck, or the "
                    "motors do not turn"
                )
        return None


def motion_of(output: Signal) -> float:
    """Return the motion of an output that a standing encoder contradicts."""
    if output.unit in ("", "rad"):
        return MOTION_RAD
    return RANGE_SHARE * (output.high - output.low)


def window_ticks(model: Model, tick_s: float) -> int:
    """Return the window: `WINDOW_S`, or as long as an error of the estimate does not grow too far."""
    longest = max(1, round(WINDOW_S / tick_s))
    start = model.initial()
    nothing, idle = (0.0,) * model.correction_size, (0.0,) * model.input_size
    moved = [
        tuple(value + (DISTURBED if place == at else 0.0) for place, value in enumerate(start))
        for at in range(model.correction_size)
    ]
    for tick in range(1, longest + 1):
        start, *moved = [model.tick(state, idle, nothing) for state in (start, *moved)]
        outputs = model.measured(start)
        far = [
            abs(value - usual) > GROWTH_MAX * DISTURBED
            for state in moved
            for value, usual in zip(model.measured(state), outputs, strict=True)
        ]
        if any(far):
            return tick
    return longest
