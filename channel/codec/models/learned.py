"""A model whose terms may be wrong, with their errors as states.

The plant's own states are followed by theta, one number for each term of its equations, and by the
terms' values as they were lately. A term adds theta_i times its value to the rate of one state: theta
is the relative error of an entry of A or B, or of a damping, weight or thrust; the term of a constant
force has the value 1. Theta changes by corrections alone (`channel.codec.coders.learning`), so that
prediction, digest, rejoin and replay carry it as they do every state.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

from channel.codec.codec import Model, Vector
from channel.codec.models.base import RowModel
from channel.codec.models.linear import LinearModel, linear_output
from channel.codec.signals import Signal, Signals, signals_of

SPREAD, FORCE_SPREAD = 0.1, 0.03
"""usual standard deviations of a term's relative error, and of a constant force in its rate's units"""


class LearnedConstants(NamedTuple):
    """Constants of `learned_row`; matrices row by row, of the plant's own states."""

    transition: Vector
    drive: Vector
    tick_s: float
    constant: Vector
    outputs: Vector
    """C, with a column for every state"""
    factors: Vector
    """per term: the entry of A or B, 1 for a constant force"""
    rests: Vector
    """per term: what its source is at rest"""
    sources: tuple[int, ...]
    """per term: a state, or behind all states an input, or behind all inputs nothing"""
    rows: tuple[int, ...]
    """per term: the state whose rate it is of"""
    freshness: float
    """of a term's mean value, by which it moves to the present one in a tick"""


def term_of(state: Vector, command: Vector, constants: LearnedConstants, term: int) -> float:
    """Return the value of a term."""
    source, size = constants.sources[term], len(constants.constant)
    factor, rest = constants.factors[term], constants.rests[term]
    if source < size:
        return factor * (state[source] - rest)
    if source < size + len(command):
        return factor * (command[source - size] - rest)
    return factor


def learned_row(
    state: Vector, command: Vector, held: Vector, constants: LearnedConstants, row: int
) -> float:
    """Return one state after a tick of a linear model (`channel.codec.models.linear`)."""
    size, terms = len(constants.constant), len(constants.factors)
    if row >= size + terms:
        value = term_of(state, command, constants, row - size - terms)
        return state[row] + constants.freshness * (value - state[row])
    if row >= size:
        return state[row] + constants.tick_s * held[row]
    inputs = len(command)
    total = constants.constant[row]
    transition, drive = constants.transition, constants.drive
    for index in range(size):
        total += transition[row * size + index] * state[index]
    for index in range(inputs):
        total += drive[row * inputs + index] * command[index]
    rate = held[row]
    for term in range(terms):
        if constants.rows[term] == row:
            rate += state[size + term] * term_of(state, command, constants, term)
    return total + constants.tick_s * rate


class LearnedModel:
    """Common parts of models that learn; `plant` is the same model with its terms as they are."""

    correction_size: int

    def __init__(self, plant: Model, names: Sequence[str], term_rows: Sequence[int]) -> None:
        """Take the names of the terms; that of a constant force ends in `_force`."""
        self.plant = plant
        self.spreads = tuple([FORCE_SPREAD if one.endswith("_force") else SPREAD for one in names])
        self.terms = tuple(names)
        self.term_rows = tuple(term_rows)
        """per term: the state whose rate it is of"""
        self.input_size = plant.input_size
        self.correction_size = plant.state_size + len(names)
        self.state_size = self.correction_size + len(names)
        own = signals_of(plant)
        more = [Signal(f"{name}_{what}") for what in ("error", "mean") for name in names]
        self.signals: Signals = replace(
            own,
            states=(*own.states, *more),
            output_rows=tuple([(*row, *[0.0] * len(more)) if row else row for row in own.output_rows]),
        )

    def initial(self) -> Vector:
        """Return the plant's initial state, nothing learned."""
        return (*self.plant.initial(), *[0.0] * (2 * len(self.terms)))

    def measured(self, state: Vector) -> Vector:
        return self.plant.measured(state[: self.plant.state_size])


def plant_model(model: Model) -> Any:
    """Return a model without its learned states: the plant's own states come first in both."""
    return model.plant if isinstance(model, LearnedModel) else model


class LearnedLinearModel(RowModel, LearnedModel):
    """A linear model of which entries of A and B may be off, and on which a constant force may act.

    `dynamics` and `drive` are A and B. Rows that only say that a state is the rate of another are not
    learned.
    """

    row_function = staticmethod(learned_row)
    output_function = staticmethod(linear_output)

    def __init__(
        self,
        plant: LinearModel,
        dynamics: Sequence[Sequence[float]],
        drive: Sequence[Sequence[float]],
        operating: tuple[Sequence[float], Sequence[float]],
        freshness: float,
    ) -> None:
        size, inputs = plant.state_size, plant.input_size
        names = signals_of(plant)
        sources = [*names.states, *names.inputs]
        rest = [*(operating[0] or [0.0] * size), *(operating[1] or [0.0] * inputs)]
        found = []
        for row in range(plant.correction_size):
            entries = [*dynamics[row], *drive[row]]
            if not any(drive[row]) and is_kinematic(dynamics[row]):
                continue
            name = names.states[row].name
            found += [
                (f"{name}_by_{sources[at].name}", row, at, value, rest[at])
                for at, value in enumerate(entries)
                if value
            ]
            found.append((f"{name}_by_force", row, size + inputs, 1.0, 0.0))
        labels, rows, places, factors, rests = zip(*found, strict=True)
        super().__init__(plant, labels, rows)
        own = plant.constants
        self.constants = LearnedConstants(
            own.transition,
            own.drive,
            own.tick_s,
            own.constant,
            tuple([value for row in plant.outputs for value in (*row, *[0.0] * (2 * len(found)))]),
            factors,
            rests,
            places,
            rows,
            freshness,
        )


def is_kinematic(entries: Sequence[float]) -> bool:
    """Return whether a row of A says only that a state is the rate of another."""
    return [value for value in entries if value] == [1.0]
