"""No prediction: angles and rates stay as the last words set them. The usual loop has no model."""

from __future__ import annotations

from collections.abc import Sequence

from channel.codec.codec import Vector
from channel.codec.models.base import FunctionModel, RowModel
from channel.codec.models.pitch import PITCH_SIGNALS
from channel.codec.signals import Signal, Signals


def hold_row(state: Vector, command: Vector, held: Vector, constants: Vector, row: int) -> float:
    """Keep a state, but for a correction held over the sample; constants: (tick in s,)."""
    return state[row] + constants[0] * held[row]


class HoldModel(RowModel, FunctionModel):
    """Angles in rad, then their rates, held between words; two motor voltages that it does not read."""

    input_size = 2
    row_function = staticmethod(hold_row)

    def __init__(self, tick_s: float, start: Vector = (), outputs: Sequence[str] = ("pitch",)) -> None:
        """`start` is the initial state; empty: at angle zero and at rest."""
        angles = tuple([Signal(name, "rad") for name in outputs])
        rates = [Signal(f"{name}_rate", "rad/s") for name in outputs]
        self.signals = Signals((*angles, *rates), PITCH_SIGNALS.inputs, angles)
        self.state_size = self.correction_size = 2 * len(outputs)
        self.constants: Vector = (tick_s,)
        self._start = start or (0.0,) * self.state_size
