"""Any linear plant as the codec predicts it, one tick at a time.

    x <- x0 + F (x - x0) + E (u - u0) + h e,     y = C x

F and E are those of a tick of h seconds under a held command, e is a correction that is held over the
tick, x0 and u0 are the operating point of a plant that was linearised, zero for one that is linear. The
matrices come by value: `tenbaud design` discretises once and writes them into the configuration, so
that no two libraries ever have to agree on a last bit.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from channel.codec.codec import Vector
from channel.codec.models.base import RowModel
from channel.codec.signals import Signals

Rows = Sequence[Sequence[float]]


class LinearConstants(NamedTuple):
    """Constants of the functions below; matrices row by row."""

    transition: Vector
    """F"""
    drive: Vector
    """E"""
    tick_s: float
    """h"""
    constant: Vector
    """x0 - F x0 - E u0"""
    outputs: Vector
    """C"""


def linear_row(
    state: Vector, command: Vector, held: Vector, constants: LinearConstants, row: int
) -> float:
    """Return one state after a tick."""
    total = constants.constant[row]
    transition, drive = constants.transition, constants.drive
    states, inputs = len(state), len(command)
    for index in range(states):
        total += transition[row * states + index] * state[index]
    for index in range(inputs):
        total += drive[row * inputs + index] * command[index]
    if row < len(held):
        total += constants.tick_s * held[row]
    return total


def linear_output(state: Vector, constants: LinearConstants, place: int) -> float:
    """Return one output of a state."""
    total = 0.0
    states = len(state)
    for index in range(states):
        total += constants.outputs[place * states + index] * state[index]
    return total


class LinearModel(RowModel):
    """Prediction model `x <- F x + E u` with the outputs `C x`.

    All states take corrections, or the first `corrected` of them. `start` is the state that both ends
    begin with, x0 if not given; `operating` is (x0, u0), each of them empty for zero. Raises ValueError
    for matrices that do not fit each other.
    """

    row_function = staticmethod(linear_row)
    output_function = staticmethod(linear_output)

    def __init__(
        self,
        transition: Rows,
        drive: Rows,
        outputs: Rows,
        tick_s: float,
        *,
        corrected: int | None = None,
        start: Sequence[float] | None = None,
        operating: tuple[Sequence[float], Sequence[float]] = ((), ()),
        signals: Signals | None = None,
    ) -> None:
        self.state_size = len(transition)
        self.input_size = len(drive[0]) if drive else 0
        check("transition", transition, self.state_size, self.state_size)
        check("drive", drive, self.state_size, self.input_size)
        check("outputs", outputs, len(outputs), self.state_size)
        self.correction_size = self.state_size if corrected is None else corrected
        if not 1 <= self.correction_size <= self.state_size:
            raise ValueError(f"corrected is {corrected}; it must be 1 to {self.state_size} states")
        rest = tuple(operating[0]) or (0.0,) * self.state_size
        held = tuple(operating[1]) or (0.0,) * self.input_size
        check("operating", (rest,), 1, self.state_size)
        check("operating", (held,), 1, self.input_size)
        self._start = rest if start is None else tuple(start)
        if len(self._start) != self.state_size:
            raise ValueError(f"start has {len(self._start)} numbers, one for each state is needed")
        self.signals = signals
        self.outputs = tuple(tuple(row) for row in outputs)
        nothing = LinearConstants(
            flat(transition), flat(drive), tick_s, (0.0,) * self.state_size, flat(outputs)
        )
        self.constants = nothing._replace(
            constant=tuple(
                [rest[row] - linear_row(rest, held, (), nothing, row) for row in range(self.state_size)]
            )
        )

    def initial(self) -> Vector:
        return self._start

    def measured(self, state: Vector) -> Vector:
        constants = self.constants
        return tuple([linear_output(state, constants, place) for place in range(len(self.outputs))])


def flat(rows: Rows) -> Vector:
    """Return a matrix as one sequence, row by row."""
    return tuple(float(value) for row in rows for value in row)


def check(name: str, rows: Rows, height: int, width: int) -> None:
    """Raise ValueError unless a matrix has this many rows and columns."""
    if height < 1 or width < 1 or len(rows) != height:
        raise ValueError(f"{name} has {len(rows)} rows; it must be {height} x {width}, 1 x 1 at least")
    for number, row in enumerate(rows, 1):
        if len(row) != width:
            raise ValueError(f"row {number} of {name} has {len(row)} numbers; {width} are needed")
