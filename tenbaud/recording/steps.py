"""Step responses: how an output follows a set-point that jumps and is then held.

The definitions are those of `step_info` in python-control, with the set-point as the final value and
the output at the jump as the initial one. A time is a whole number of ticks.
"""

from __future__ import annotations

from typing import TypedDict

import numpy as np

from tenbaud.recording.table import Series

SETTLING_BAND = 0.02
"""of the step, either way"""
RISE = (0.1, 0.9)
"""of the step, between which the rise time is taken"""
HELD_TICKS_MIN = 50
"""A set-point is held this long before and after a jump that counts: a sine or a ramp has no steps."""

BEGINNING_S = 1.0
"""A set-point that is known by this flight time is the first of its flight."""


class Step(TypedDict):
    """One step response; values are in the unit of the output. None: not within the hold."""

    time_s: float
    """flight time of the jump"""
    from_value: float
    """the output at the jump"""
    to_value: float
    """the set-point from then on"""
    rise_time_s: float | None
    """from 10 % to 90 % of the step"""
    overshoot_fraction: float
    """of the step, beyond the set-point; 0 without any"""
    settling_time_s: float | None
    """until the output stays within the band around the set-point"""


def steps_of(
    time_s: Series, reference: Series, values: Series, band: float = SETTLING_BAND
) -> list[Step]:
    """Return the response to every step of a set-point.

    At the beginning of a flight the set-point was 0 before; a recording that begins later does not show
    its first step. An output that is unknown has not settled, and a step from such a one is left out.
    `band`, a fraction of the step, is for settling.
    """
    known = np.flatnonzero(~np.isnan(reference))
    if not len(known):
        return []
    first = int(known[0])
    begins = time_s[first] <= BEGINNING_S
    changes = np.flatnonzero(np.diff(reference[first:])) + first + 1
    edges = [first, *changes.tolist(), len(reference)]
    lengths = np.diff(edges)
    found = []
    for place, (start, length) in enumerate(zip(edges, lengths, strict=False)):
        jumps = (
            begins and bool(reference[start]) if place == 0 else lengths[place - 1] >= HELD_TICKS_MIN
        )
        apart = not np.isnan(values[start]) and values[start] != reference[start]
        if jumps and length >= HELD_TICKS_MIN and apart:
            held = slice(start, start + length)
            found.append(_response(time_s[held], float(reference[start]), values[held], band))
    return found


def _response(time_s: Series, target: float, values: Series, band: float) -> Step:
    initial = float(values[0])
    done = (values - initial) / (target - initial)
    low, high = (_first(done >= share) for share in RISE)
    outside = np.flatnonzero(~(np.abs(done - 1.0) < band))
    settled = int(outside[-1]) + 1 if len(outside) else 0

    def between(first: int, last: int) -> float:
        return round(float(time_s[last] - time_s[first]), 9)

    return {
        "time_s": float(time_s[0]),
        "from_value": initial,
        "to_value": target,
        "rise_time_s": None if low is None or high is None else between(low, high),
        "overshoot_fraction": max(0.0, float(np.nanmax(done)) - 1.0),
        "settling_time_s": between(0, settled) if settled < len(time_s) else None,
    }


def _first(where: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]) -> int | None:
    return int(where.argmax()) if where.any() else None
