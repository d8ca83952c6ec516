"""The simulated plants that a flight is compiled with: those that are written as functions."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from plant_sim.ode import OdePlant, ode_step
from tenbaud.studies.compiled import arrays_of, named, part, reader, states_read, whole_of
from tenbaud.studies.schedule import Uncommon


class AtRest:
    """The plant of a recorded flight: there is none to be moved."""

    state = constants = (0.0,)

    def pushes(self, steps: int) -> Any:
        return np.zeros((1, 1))

    @staticmethod
    def step_function(state: Any, command: Any, push: Any, constants: Any, sine: Any) -> Any:
        return state


class PlantParts(NamedTuple):
    """The parts of a plant that a flight uses; see `parts.py`."""

    step: Any
    output: Any
    of: Any
    start: tuple[float, ...]
    constants: Any


def plant_parts(plant: Any, outputs: int) -> PlantParts:
    """Return the parts of a plant; Uncommon for one that is not written as functions.

    It has `slopes` (`plant_sim.ode`), or a `step_function` (state, command, push, constants, sine), or
    for any number of states a `row_function` (state, command, push, constants, row) and an
    `output_function` (state, constants, place); with these its `state`, `constants` and `pushes`.
    """
    first = states_read(tuple(range(outputs)))
    if isinstance(plant, OdePlant):
        start = (*plant.state, *plant.motors)
        of = pair_reader(len(plant.state), len(plant.motors))
        step = plant_step_of(plant.slopes)
        return PlantParts(step, part(first_output), of, start, plant.step_constants)
    of = reader(len(getattr(plant, "state", ())))
    if hasattr(plant, "step_function"):
        return PlantParts(part(plant.step_function), first, of, plant.state, plant.constants)
    if hasattr(plant, "row_function"):
        step, output = plant_row_step_of(plant.row_function), part(plant.output_function)
        return PlantParts(step, output, of, plant.state, arrays_of(plant.constants))
    raise Uncommon("a plant that is not written as functions")


@cache
def plant_step_of(slopes: Callable[..., Any]) -> Any:
    """Return the compiled step of a plant of these equations (`plant_sim.ode`)."""
    step, equations = part(ode_step), part(slopes)

    def plant_step(state: Any, command: Any, push: Any, constants: Any, sine: Any) -> Any:
        return step(equations, state, command, push, constants, sine)

    # It refers to another function by its place in memory, until it is part of a flight.
    return named(plant_step, f"step_{slopes.__name__}", keep=False)


@cache
def plant_row_step_of(row_function: Callable[..., float]) -> Any:
    """Return the compiled step of a plant that is written row by row."""
    whole = whole_of(row_function, True)

    def plant_step(state: Any, command: Any, push: Any, constants: Any, sine: Any) -> Any:
        return whole(state, command, push, constants)

    return named(plant_step, f"step_{row_function.__name__}")


@cache
def pair_reader(first: int, second: int) -> Any:
    """Return a compiled function that makes two tuples of an array's values."""
    one, other = reader(first), reader(second)

    def read(values: Any) -> Any:
        return one(values), other(values[first:])

    return named(read, f"read_{first}_{second}")


def first_output(state: Any, constants: Any, place: int) -> Any:
    """Return an output that is a state of the first tuple."""
    return state[0][place]
