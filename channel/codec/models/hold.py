"""No prediction at all: angle and rate stay as the last word said. The usual loop has no model."""

from __future__ import annotations

from channel.codec.codec import Vector
from channel.codec.models.pitch import PITCH_SIGNALS
from channel.codec.signals import Signals


def hold_tick(state: Vector, command: Vector, held: Vector, constants: Vector) -> Vector:
    """Keep the state, but for a correction that is held over the sample; constants: (tick in s,)."""
    return (state[0] + constants[0] * held[0], state[1] + constants[0] * held[1])


class HoldModel:
    """States (angle rad, rate rad/s), held between words; two motor voltages that it does not read."""

    state_size = 2
    correction_size = 2
    input_size = 2
    signals = Signals(PITCH_SIGNALS.states[:2], PITCH_SIGNALS.inputs, PITCH_SIGNALS.outputs)
    tick_function = staticmethod(hold_tick)

    def __init__(self, tick_s: float, start: Vector = ()) -> None:
        """`start` is the initial state; empty: at angle zero and at rest."""
        self.constants: Vector = (tick_s,)
        self._start = start or (0.0, 0.0)

    def initial(self) -> Vector:
        """Return the state that both ends begin with."""
        return self._start

    def measured(self, state: Vector) -> Vector:
        """Return the angle, the one measured axis."""
        return state[:1]

    def tick(self, state: Vector, command: Vector, held: Vector) -> Vector:
        """Advance by one tick; see `hold_tick`."""
        return hold_tick(state, command, held, self.constants)
