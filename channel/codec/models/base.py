"""The structure of the models here: functions over numbers, as that of the coders.

The nodes run these functions as they stand; a study compiles the very same ones.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from channel.codec.codec import Vector


class FunctionModel:
    """A `Model` whose first states are its outputs. Kinds say what is named below."""

    tick_function: Callable[..., Vector]
    """(state, command, held, constants) -> the state a tick later"""
    constants: Any
    signals: Any
    _start: Vector

    def initial(self) -> Vector:
        return self._start

    def measured(self, state: Vector) -> Vector:
        return state[: len(self.signals.outputs)]

    def tick(self, state: Vector, command: Vector, held: Vector) -> Vector:
        return self.tick_function(state, command, held, self.constants)


class RowModel:
    """Advances by a tick state by state."""

    row_function: Callable[..., float]
    """(state, command, held, constants, row) -> one state a tick later"""
    constants: Any
    state_size: int

    def tick(self, state: Vector, command: Vector, held: Vector) -> Vector:
        row_of, constants = self.row_function, self.constants
        return tuple([row_of(state, command, held, constants, row) for row in range(self.state_size)])
