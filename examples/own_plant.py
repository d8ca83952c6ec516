"""A plant of your own: the helicopter with a gust now and then that the model knows nothing of.

python examples/own_plant.py
cd examples && tenbaud demo --set transmitter.plant.kind=own_plant:Gusty
"""

from __future__ import annotations

import random

import numpy as np

from plant_sim.pitch import PitchParameters, PitchPlant
from plant_sim.plant import PlantContext
from tenbaud import fly


class Gust:
    """A torque for a tenth of a second, every few seconds."""

    def __init__(self, seed: int, step_s: float, strength: float) -> None:
        self.noise = random.Random(seed)
        self.step_s = step_s
        self.strength = strength  # rad/s^2
        self.now = 0.0
        self.until = 0

    def torque(self, step: int) -> float:
        """Return the torque of a step, in rad/s^2."""
        if step >= self.until:
            begins = self.noise.random() < 0.3 * self.step_s
            self.now = self.noise.choice((-1.0, 1.0)) * self.strength if begins else 0.0
            self.until = step + (round(0.1 / self.step_s) if begins else 1)
        return self.now


class Gusty(PitchPlant):
    """The pitch axis of the paper, in a wind."""

    def __init__(self, context: PlantContext, strength: float = 3.0) -> None:
        gust = Gust(context.seed, context.step_s, strength)
        super().__init__(PitchParameters(), context.step_s, gust)


if __name__ == "__main__":
    for strength in (0.0, 3.0, 10.0):
        settings = {
            "duration_s": 60.0,
            "transmitter.plant.kind": "own_plant:Gusty",
            "transmitter.plant.options.strength": strength,
        }
        run = fly("tuned-10baud", settings=settings)
        rms = np.sqrt(np.mean(run.error_coded**2))
        print(f"gusts of {strength:4.1f} rad/s^2: rms error {rms:.4f} rad")
