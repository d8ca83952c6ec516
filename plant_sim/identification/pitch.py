"""The angle of a pitch axis at rest, theta_0 of (11): measured in a quiescent stretch."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import maximum_filter1d

from plant_sim.identification.filters import Array
from plant_sim.identification.record import Record
from plant_sim.identification.structures import PitchStructure

QUIET_S = 2.0
QUIET_VOLTS = 0.05


@dataclass(frozen=True, slots=True)
class QuietStretch:
    """The angle of the body at rest with its motors off."""

    start_s: float
    end_s: float
    angle_rad: float
    """mean angle there: theta_0"""


def quiescent_angle(record: Record, *, spread_rad: float = 0.02) -> QuietStretch | None:
    """Return the longest stretch in which the body rests and the motors pull equally; None if none.

    It rests while its angle stays within `spread_rad` over `QUIET_S` and the voltages differ by at
    most `QUIET_VOLTS`.
    """
    steps = max(2, round(QUIET_S / record.step_s))
    if len(record) < steps:
        return None
    difference = np.abs(PitchStructure().acting(record.inputs)[:, 0])
    angle = record.outputs[:, 0]
    quiet = (_largest(angle, steps) + _largest(-angle, steps) <= spread_rad) & (
        _largest(difference, steps) <= QUIET_VOLTS
    )
    edges = np.flatnonzero(np.diff(np.concatenate(([False], quiet, [False])).astype(np.int8)))
    if not len(edges):
        return None
    starts, ends = edges[::2], edges[1::2]
    best = int(np.argmax(ends - starts))
    start, end = int(starts[best]), int(ends[best]) - 1 + steps
    mean = float(angle[start:end].mean())
    return QuietStretch(start * record.step_s, end * record.step_s, mean)


def _largest(values: Array, steps: int) -> Array:
    """Return the largest value of each whole window, by its first sample."""
    first = steps // 2
    whole = maximum_filter1d(values, steps)
    return np.asarray(whole[first : first + len(values) - steps + 1])
