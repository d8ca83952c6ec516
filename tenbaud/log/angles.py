"""Wrapped angles, spikes and counts of a log's outputs."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from plant_sim.encoder import EXACT_PER_UNIT, Encoder, OutputReader
from tenbaud.log.table import Array
from tenbaud.log.units import turn_in

JUMP = 0.75
"""Share of a turn from which a step between two rows is the seam of a wrapped angle."""
SPIKE = 20.0
"""Times the usual bend of a signal from which a single row is a spike."""
SPIKES_MAX_SHARE = 0.02
STEP_ROWS = 100_000
"""Rows at the beginning in which the step of a quantised signal is looked for."""
STEP_NEAR = 10.0
"""Smallest steps between two values that tell the step."""
STEP_GAPS_MIN = 10
"""Such gaps that are needed, or all of them where there are fewer."""
STEP_SHARE = 1e-6
"""Of the range, from which a step is one."""
STEP_ERROR = 0.05
"""Share of a step by which numbers with few digits may be off it."""


@dataclass(frozen=True)
class Straightened:
    """Values without the recording's distortions, and the rows of these."""

    values: Array
    rows: tuple[int, ...]


def unwrapped(values: Array, turn: float) -> Straightened:
    """Return an angle that goes on where its encoder began again at 0 or half a turn."""
    cleaned = without_spikes(values, turn).values
    steps = np.diff(cleaned)
    seams = np.flatnonzero(np.abs(steps) > JUMP * turn)
    if not len(seams) or np.ptp(cleaned) > turn * (1.0 + 1e-6):
        return Straightened(values, ())
    whole = np.round(steps[seams] / turn)
    shift = np.zeros(len(values))
    shift[seams + 1] = -whole * turn
    return Straightened(values + np.cumsum(shift), tuple((seams + 1).tolist()))


def without_spikes(values: Array, turn: float | None) -> Straightened:
    """Return the values with single rows that are far off both neighbours set between them.

    `turn` keeps the seams of a wrapped angle, which look alike.
    """
    if len(values) < 5:
        return Straightened(values, ())
    between = 0.5 * (values[:-2] + values[2:])
    bend = values[1:-1] - between
    usual = max(
        float(np.median(np.abs(bend))), 0.002 * float(np.subtract(*np.percentile(values, (95, 5))))
    )
    around = np.abs(values[2:] - values[:-2])
    off = (np.abs(bend) > SPIKE * usual) & (around < 0.25 * np.abs(bend)) & (np.abs(bend) > 0.0)
    rest = np.delete(values, np.flatnonzero(off) + 1)
    if turn is not None and np.ptp(rest) <= (whole := turn * (1.0 + 1e-6)):
        beyond = (values[1:-1] < rest.max() - whole) | (values[1:-1] > rest.min() + whole)
        off &= (np.abs(bend) < JUMP * turn) | beyond
    rows = np.flatnonzero(off)
    if not len(rows) or len(rows) > max(1.0, SPIKES_MAX_SHARE * len(values)):
        return Straightened(values, ())
    cleaned = values.copy()
    cleaned[rows + 1] = between[rows]
    return Straightened(cleaned, tuple((rows + 1).tolist()))


def counts_of(values: Array, encoder: OutputReader | None) -> npt.NDArray[np.int64]:
    """Return an encoder's readings of values in the output's unit."""
    if isinstance(encoder, Encoder):
        steps = np.floor(values / encoder.turn * encoder.counts_per_turn + 0.5)
        return encoder.sign * steps.astype(np.int64) + encoder.zero_counts
    return np.floor(values * EXACT_PER_UNIT).astype(np.int64)


def step_of(values: Array) -> float:
    """Return how far the values of a quantised signal lie apart; 0 where no step shows."""
    seen = np.unique(values[:STEP_ROWS])
    gaps = np.diff(seen)
    if not len(gaps):
        return 0.0
    near = gaps[gaps < STEP_NEAR * gaps.min()]
    if len(near) < min(STEP_GAPS_MIN, len(gaps)) or gaps.min() < STEP_SHARE * (seen[-1] - seen[0]):
        return 0.0
    steps = np.round(near / gaps.min())
    step = float(near.sum() / steps.sum())
    return step if np.all(np.abs(near / step - steps) < STEP_ERROR * steps) else 0.0


def turn_of(unit: str, encoder: OutputReader | None) -> float | None:
    """Return the length of a turn in a unit of an angle; None for other units."""
    if unit == "counts":
        full = isinstance(encoder, Encoder) and encoder.turn in (math.tau, 360.0)
        return encoder.counts_per_turn if full and isinstance(encoder, Encoder) else None
    return turn_in(unit) if unit else None
