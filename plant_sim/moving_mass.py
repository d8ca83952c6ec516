"""A mass on a screw along an arm: its weight pulls the arm down, and it takes its time to move."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from plant_sim.disturbance import BLOCK_STEPS, PlannedDisturbance, Torques

SPEED_M_PER_S: Final = 0.08
RANGE_M: Final = 0.1397
"""to either side of its home: the screw of Quanser's active disturbance system"""


class MovingMass(PlannedDisturbance):
    """The torque of a mass that is sent to positions, at home before the first.

    It moves at the speed of its screw. The arm is taken as level: within 30 degrees the torque is at
    most a seventh smaller.
    """

    def __init__(
        self, moves: Sequence[Sequence[float]], torque_rad_per_s2_per_m: float, step_s: float
    ) -> None:
        """Take (time, position) in rising order; ValueError for others."""
        times_s, places_m, at_m = [0.0], [0.0], 0.0
        for move in moves:
            start_s, wanted_m = _numbers_of(move)
            if start_s < 0.0:
                raise ValueError(f"mass_moves: a move begins at {start_s:g} s, and the flight at 0 s")
            if abs(wanted_m) > RANGE_M:
                raise ValueError(
                    f"mass_moves sends the mass to {wanted_m:g} m; its screw ends at {RANGE_M:g} m to "
                    "either side"
                )
            if start_s < times_s[-1]:
                raise ValueError(
                    f"mass_moves: the mass is moving until {times_s[-1]:g} s, and the next move begins "
                    f"at {start_s:g} s"
                )
            times_s += [start_s, start_s + abs(wanted_m - at_m) / SPEED_M_PER_S]
            places_m += [at_m, wanted_m]
            at_m = wanted_m
        self._times_s, self._places_m = times_s, places_m
        self._torque_per_m, self._step_s = torque_rad_per_s2_per_m, step_s

    def draw(self, block_index: int) -> Torques:
        times_s = np.arange(BLOCK_STEPS, dtype=float) + float(block_index * BLOCK_STEPS)
        places_m = np.interp(times_s * self._step_s, self._times_s, self._places_m)
        return self._torque_per_m * places_m


def _numbers_of(move: object) -> tuple[float, float]:
    """Return time and position of a move; ValueError for anything else."""
    match move:
        case [int() | float() as start_s, int() | float() as wanted_m] if math.isfinite(
            start_s
        ) and math.isfinite(wanted_m):
            return start_s, wanted_m
    raise ValueError(f"mass_moves has {move!r}; it is a list of moves, [time in s, position in m] each")
