"""A plant of your own: the helicopter with a gust now and then that the model knows nothing of.

python examples/own_plant.py
"""

from __future__ import annotations

import random

import numpy as np

from tenbaud import fly
from tenbaud.plants import PitchParameters, PitchPlant

TICK_S = 0.01


class Gust:
    """A torque for a tenth of a second, every few seconds."""

    def __init__(self, seed: int, strength: float) -> None:
        self.noise = random.Random(seed)
        self.strength = strength  # rad/s^2
        self.now = 0.0
        self.until = 0

    def torque(self, step: int) -> float:
        """Return the torque of a step, in rad/s^2."""
        if step >= self.until:
            begins = self.noise.random() < 0.3 * TICK_S
            self.now = self.noise.choice((-1.0, 1.0)) * self.strength if begins else 0.0
            self.until = step + (round(0.1 / TICK_S) if begins else 1)
        return self.now


class Gusty(PitchPlant):
    """The pitch axis of the paper, in a wind."""

    def __init__(self, strength: float) -> None:
        super().__init__(PitchParameters(), TICK_S, Gust(1, strength))


if __name__ == "__main__":
    for strength in (0.0, 3.0, 10.0):
        run = fly("tuned-10baud", settings={"duration_s": 60.0}, plant=Gusty(strength))
        rms = np.sqrt(np.mean(run.error_coded**2))
        print(f"gusts of {strength:4.1f} rad/s^2: rms error {rms:.4f} rad")
