"""A linear plant, advanced exactly: dx/dt = A (x - x0) + B (u - u0) + G w,   y = C x.

Command and disturbance are held over a step, and A, B and G are discretised for that (zero-order hold).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from plant_sim.plant import PlantContext, SteppedPlant
from plant_sim.zero_order_hold import Matrix, continuous, discretised

Vector = tuple[float, ...]
Rows = Sequence[Sequence[float]]

NEAR = 1e-9


class LinearStep(NamedTuple):
    """Constants of `linear_step`; matrices row by row."""

    transition: Vector
    drive: Vector
    """of the inputs, then of the places that are disturbed"""
    constant: Vector
    outputs: Vector


def linear_step(state: Vector, held: Vector, push: Vector, constants: LinearStep, row: int) -> float:
    """Return one state after a step of held inputs and disturbances."""
    total = constants.constant[row]
    transition, drive = constants.transition, constants.drive
    size, inputs, pushes = len(state), len(held), len(push)
    for index in range(size):
        total += transition[row * size + index] * state[index]
    start = row * (inputs + pushes)
    for index in range(inputs):
        total += drive[start + index] * held[index]
    for index in range(pushes):
        total += drive[start + inputs + index] * push[index]
    return total


def linear_output(state: Vector, constants: LinearStep, place: int) -> float:
    """Return one output of a state."""
    total = 0.0
    size = len(state)
    for index in range(size):
        total += constants.outputs[place * size + index] * state[index]
    return total


class SimulatedLinear(SteppedPlant):
    """A `Plant` of matrices: those of the codec's model, off by the mismatch, or those of its options.

    One mismatch is of every entry of A and B but those of rows like `angle' = rate`; three are of the
    entries that rates have in A, of those that other states have there, and of B. `start` is the
    state at the start; without it the start follows from the configured outputs or, where there are
    none, it is the model's. Disturbances come through G, or where the commands do.
    """

    row_function = staticmethod(linear_step)
    output_function = staticmethod(linear_output)

    def __init__(
        self,
        context: PlantContext,
        A: Rows = (),
        B: Rows = (),
        C: Rows = (),
        G: Rows = (),
        start: Sequence[float] = (),
    ) -> None:
        given = {"A": A, "B": B, "C": C, "G": G}
        options = {name: value for name, value in given.items() if value}
        model = {**context.model, **options}
        if "C" not in model or not (model.get("A") or model.get("F") or "B" in options):
            raise ValueError(
                "the codec's model has no matrices; give A, B and C in transmitter.plant.options"
            )
        if not (model.get("A") and model.get("B")) and {"A", "B"} & options.keys():
            raise ValueError("the codec's model has no A and B; give both, or neither of them")
        F, E, noise = _stepped(model, context)
        super().__init__(context, noise.shape[1])
        size, inputs = E.shape
        c = _matrix("C", model["C"], len(context.outputs) or None, size)
        at = _matrix("operating_state", model.get("operating_state") or [0.0] * size, 1, size)[0]
        rest = model.get("operating_command") or [0.0] * inputs
        command = _matrix("operating_command", rest, 1, inputs)[0]
        self.constants = LinearStep(
            _flat(F),
            _flat(np.hstack([E, noise])),
            tuple((at - F @ at - E @ command).tolist()),
            _flat(c),
        )
        self._outputs = range(len(c))
        begin = _matrix("start", [start or model.get("start") or at], 1, size)[0]
        if context.initial and not start:
            rows = c[: len(context.initial)]
            begin = begin + np.linalg.pinv(rows) @ (np.array(context.initial) - rows @ begin)
        self.state: Vector = tuple(begin.tolist())
        self._rows = range(size)

    @property
    def measured(self) -> Vector:
        return tuple([linear_output(self.state, self.constants, place) for place in self._outputs])

    def _step(self, held: Vector, push: Vector) -> None:
        state, constants = self.state, self.constants
        self.state = tuple([linear_step(state, held, push, constants, row) for row in self._rows])


def _stepped(model: Mapping[str, Any], context: PlantContext) -> tuple[Matrix, ...]:
    """Return F, E and the effect of a held disturbance in a step."""
    step_s, off = context.step_s, context.mismatch
    names = "AB" if model.get("A") else "FE"
    a = _matrix(names[0], model[names[0]], None, len(model[names[0]]))
    b = _matrix(names[1], model[names[1]], len(a), len(context.command_max))
    if names == "FE":
        if not context.disturbance_text and not np.any(off):
            return a, b, np.zeros((len(a), 0))
        a, b = continuous(a, b, step_s)
    g = _matrix("G", model.get("G") or b, len(a), None)
    a, b = _mismatched(a, b, off if isinstance(off, tuple) else (off,) * 3)
    F, both = discretised(a, np.hstack([b, g]), step_s)
    return F, both[:, : b.shape[1]], both[:, b.shape[1] :]


def _mismatched(a: Matrix, b: Matrix, off: Sequence[float]) -> tuple[Matrix, Matrix]:
    """Return A and B of a plant that is off these; rows like `angle' = rate` are what they are."""
    # Not exactly: where only F and E are known, A and B are what logm finds.
    one, none = np.isclose(a, 1.0, atol=NEAR), np.isclose(a, 0.0, atol=NEAR)
    alone = (one.sum(axis=1) == 1) & (none.sum(axis=1) == len(a) - 1)
    kinematic = alone & np.isclose(b, 0.0, atol=NEAR).all(axis=1)
    rates = one[kinematic].any(axis=0)
    dynamic = ~kinematic[:, None]
    damping, stiffness, gain = off
    a = a * np.where(dynamic, 1.0 + np.where(rates, damping, stiffness), 1.0)
    return a, b * np.where(dynamic, 1.0 + gain, 1.0)


def _matrix(name: str, given: Any, height: int | None, width: int | None) -> Matrix:
    """Return a matrix of this many rows and columns; ValueError for any other."""
    try:
        matrix = np.atleast_2d(np.array(given, dtype=float))
    except (TypeError, ValueError) as error:
        raise ValueError(f"{name} must be rows of numbers, all of one length, got {given}") from error
    wanted = (height or len(matrix), width or matrix.shape[1])
    if matrix.shape != wanted or not np.isfinite(matrix).all():
        raise ValueError(f"{name} must be {wanted[0]} x {wanted[1]} finite numbers, got {given}")
    return matrix


def _flat(matrix: Matrix) -> Vector:
    return tuple(matrix.ravel().tolist())
