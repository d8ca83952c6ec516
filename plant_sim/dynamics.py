"""A plant from functions: dx/dt = f(t, x, u), or the next state if discrete, and y = g(t, x, u).

They come from a program, such as a nonlinear system of python-control.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from plant_sim.plant import PlantContext, held_command

Function = Callable[[float, NDArray[np.float64], NDArray[np.float64]], Any]


class FunctionPlant:
    """A `Plant` that does not change with time, from its `start` under `command`.

    `substeps` of Runge and Kutta (fourth order) make a step; 0: `dynamics` returns the state after it.
    The disturbance acts like the commands, or through `noise`, a column for each place. ValueError for
    a mismatch: functions have no constants to be changed.
    """

    def __init__(
        self,
        context: PlantContext,
        dynamics: Function,
        output: Function,
        start: Sequence[float],
        command: Sequence[float],
        substeps: int,
        noise: NDArray[np.float64] | None = None,
    ) -> None:
        if np.any(context.mismatch):
            raise ValueError(
                "transmitter.plant.mismatch is for plants with constants, and this one is a function; "
                "change its own parameters"
            )
        self._dynamics = dynamics
        self._output = output
        self._noise = noise
        self._command_max = context.command_max
        self._substeps = substeps
        self._step_s = context.step_s / max(substeps, 1)
        places = len(command) if noise is None else noise.shape[1]
        self._disturbances = context.disturbances(places)
        self._steps = 0
        self.state = np.array(start, dtype=float)
        self._held = np.array(command, dtype=float)

    @property
    def measured(self) -> tuple[float, ...]:
        """The outputs, which follow from the state alone."""
        values = np.atleast_1d(np.asarray(self._output(0.0, self.state, self._held), dtype=float))
        return tuple(values.tolist())

    def advance(self, command: tuple[float, ...]) -> None:
        held = np.array(held_command(command, self._command_max))
        self._held = held
        push: NDArray[np.float64] | float = 0.0
        if self._disturbances:
            found = np.array([one.torque(self._steps) for one in self._disturbances])
            if self._noise is None:
                held = held + found
            else:
                push = self._noise @ found
        self._steps += 1
        if not self._substeps:
            self.state = (
                np.asarray(self._dynamics(0.0, self.state, held), dtype=float) + self._step_s * push
            )
        h, half = self._step_s, 0.5 * self._step_s
        for _ in range(self._substeps):
            x = self.state
            k1 = self._slope(x, held, push)
            k2 = self._slope(x + half * k1, held, push)
            k3 = self._slope(x + half * k2, held, push)
            k4 = self._slope(x + h * k3, held, push)
            self.state = x + h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)

    def _slope(
        self, x: NDArray[np.float64], held: NDArray[np.float64], push: NDArray[np.float64] | float
    ) -> NDArray[np.float64]:
        return np.asarray(self._dynamics(0.0, x, held), dtype=float) + push
