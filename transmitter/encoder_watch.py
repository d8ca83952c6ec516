"""Notices an encoder that is stuck: counts that stand still while the body must be moving.

Standing still proves nothing by itself, a body at its set-point does too. So the codec's model is
carried on from its estimate, without corrections, under the voltages that were applied; only when it
says that the body has moved far, and not one count has changed, is the encoder taken for stuck.
"""

from __future__ import annotations

from collections import deque

from channel.codec.codec import Codec, Vector

MOTION_RAD = 1.0
"""Predicted motion that a standing encoder contradicts. Prediction from an estimate 10 % off the
plant errs by about 0.1 rad in the window, full voltage moves the body 1.75 rad."""

WINDOW_S = 1.0


class EncoderWatch:
    """Watches every measured axis; costs next to nothing while their counts change."""

    def __init__(self, codec: Codec, tick_s: float) -> None:
        self._model = codec.model
        self._nothing_held = codec.nothing_held
        self._window_ticks = max(1, round(WINDOW_S / tick_s))
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
                except (ArithmeticError, ValueError):  # beyond what the model can say
                    self._age_ticks = 0
                    return None
        if self._age_ticks < self._window_ticks:
            return None
        self._age_ticks = 0
        return self._judge(counts)

    def _judge(self, counts: tuple[int, ...]) -> str | None:
        """Compare, at the end of a window, what the model says with axes that never changed."""
        start, end = self._model.measured(self._start), self._model.measured(self._state)
        for axis, ticks in enumerate(self._still_ticks):
            moved = end[axis] - start[axis]
            if ticks >= self._window_ticks and not -MOTION_RAD < moved < MOTION_RAD:
                return (
                    f"the encoder of axis {axis} stood at {counts[axis]} counts for {WINDOW_S:g} s "
                    f"in which the body should have turned {moved:.2f} rad: it is stuck, or the "
                    "motors do not turn"
                )
        return None
