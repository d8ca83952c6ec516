"""A plant from functions: dx/dt = f(t, x, u), or the next state if discrete, and y = g(t, x, u).

They come from a program, such as a nonlinear system of python-control.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from plant_sim.plant import PlantContext, SteppedPlant

Function = Callable[[float, NDArray[np.float64], NDArray[np.float64]], Any]


class FunctionPlant(SteppedPlant):
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
        super().__init__(context, len(command) if noise is None else noise.shape[1])
        self._dynamics = dynamics
        self._output = output
        self._noise = noise
        self._substeps = substeps
        self._step_s = context.step_s / max(substeps, 1)
        self.state = np.array(start, dtype=float)
        self._held = np.array(command, dtype=float)

    @property
    def measured(self) -> tuple[float, ...]:
        values = np.atleast_1d(np.asarray(self._output(0.0, self.state, self._held), dtype=float))
        return tuple(values.tolist())

    def _step(self, held: tuple[float, ...], push: tuple[float, ...]) -> None:
        self._held = np.array(held)
        u = self._held
        pushed: NDArray[np.float64] = np.zeros_like(self.state)
        if self._noise is None:
            u = u + push
        else:
            pushed = self._noise @ push

        def slope(x: NDArray[np.float64]) -> NDArray[np.float64]:
            rates: NDArray[np.float64] = np.asarray(self._dynamics(0.0, x, u), dtype=float)
            return rates + pushed

        h, half = self._step_s, 0.5 * self._step_s
        if not self._substeps:
            pushed = h * pushed
            self.state = slope(self.state)
        for _ in range(self._substeps):
            x = self.state
            k1 = slope(x)
            k2 = slope(x + half * k1)
            k3 = slope(x + half * k2)
            k4 = slope(x + h * k3)
            self.state = x + h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)
