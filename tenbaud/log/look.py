"""What a column of a log looks like: a clock, an index, counts, an angle, a command, a signal."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tenbaud.log.angles import unwrapped
from tenbaud.log.table import Array, Table
from tenbaud.log.units import COUNTS, is_speed, unit_named

LEVELS_MAX = 8
"""Different values of a command that switches between levels."""
HELD_SHARE = 0.5
"""Rows that repeat the value before, from which a column is one that holds its value."""
EVEN_SHARE = 0.5
"""Of the usual step: how much the steps of a clock may differ from it, apart from few."""
RATE_MATCH = 0.95
"""Correlation with the slope of another column from which a column is its rate."""
ROWS_MAX = 200_000
"""Looked at where the first rows say enough."""
RADIANS_MAX = 30.0
TURNS = {"deg": 360.0, "rad": math.tau}
KINDS = {
    **dict.fromkeys(("rad", "deg", "turn", "mrad"), "angle"),
    **dict.fromkeys(("rad/s", "deg/s", "rpm"), "rate"),
    **dict.fromkeys(("V", "mV", "A", "mA", "N m", "mN m"), "command"),
}


@dataclass(frozen=True, slots=True)
class Look:
    """One column as people should see it."""

    name: str
    kind: str
    """clock, index, counts, angle, rate, command, constant, signal or empty"""
    words: str
    """the same in some more words"""
    unit: str
    """as the file says; with `guess` as the values suggest"""
    guess: str = ""
    """why the unit is thought to be this one; empty: the file says so, or nothing is known"""
    lowest: float = math.nan
    highest: float = math.nan
    missing: int = 0
    """cells that hold no number"""

    @property
    def moves(self) -> bool:
        """Whether it may be an output."""
        return self.kind in ("angle", "counts", "signal")


def looks_of(table: Table) -> list[Look]:
    """Return what every column of a table looks like."""
    first = [_look(table, place) for place in range(len(table.names))]
    return [_with_rate(table, first, place) for place in range(len(first))]


def _look(table: Table, place: int) -> Look:
    name, values = table.names[place], table.columns[place]
    unit = unit_named(table.units[place]) or table.units[place]
    there = values[np.isfinite(values)]
    missing = len(values) - len(there)
    if not len(there):
        text = next((text for _, text in table.faults.get(name, ())), "")
        return Look(name, "empty", f"text, such as {text!r}" if text else "no numbers", unit)
    kind, words, told = _kind(there, unit)
    guess = ""
    if not unit and told:
        unit, _, guess = told.partition(": ")
        if unit == COUNTS and is_speed(name):
            unit = guess = ""
    return Look(name, kind, words, unit, guess, float(there.min()), float(there.max()), missing)


def _kind(values: Array, unit: str) -> tuple[str, str, str]:
    """Return kind, words, and "UNIT: why" where the values suggest one."""
    if np.ptp(values) == 0.0:
        return "constant", "constant", ""
    steps = np.diff(values)
    usual = float(np.median(steps))
    if usual == 1.0 and np.all(steps == 1.0):
        return "index", "index of the rows", ""
    if usual > 0.0 and np.mean(np.abs(steps - usual) <= EVEN_SHARE * usual) > 0.95:
        return "clock", f"clock, {usual:.6g} a row", _clock_unit(usual)
    levels = np.unique(values[:: max(1, len(values) // ROWS_MAX)])
    if len(levels) <= LEVELS_MAX:
        return KINDS.get(unit, "command"), f"{len(levels)} levels", ""
    kind = KINDS.get(unit, "")
    for name, turn in TURNS.items():
        seams = len(unwrapped(values, turn).rows) if unit in ("", name) else 0
        if seams and seams < 0.05 * len(values):
            return "angle", f"angle, wraps {seams} times", f"{name}: it jumps by {turn:.4g}"
    if unit in ("", COUNTS) and np.all(values == np.floor(values)):
        return "counts", "whole numbers", f"{COUNTS}: all values are whole"
    if unit in ("", *TURNS) and (counted := _encoder(steps, unit)):
        name, per_turn = counted
        return "angle", f"angle, {per_turn} steps a turn", f"{name}: {per_turn} steps are a turn"
    if not kind and np.mean(steps == 0.0) > HELD_SHARE:
        return "command", f"holds its value in {100.0 * np.mean(steps == 0.0):.0f} % of the rows", ""
    largest = float(np.max(np.abs(values)))
    return kind or "signal", kind or "signal", f"{_unit_by_size(largest)}: it reaches {largest:.3g}"


def _unit_by_size(largest: float) -> str:
    return "deg" if largest > RADIANS_MAX else "rad"


def _clock_unit(step: float) -> str:
    """Return the unit in which a row every `step` is more often than once a second."""
    for unit, factor in (("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9)):
        if step * factor < 1.0:
            return f"{unit}: a row every {step:.6g}"
    return ""


def _encoder(steps: Array, unit: str) -> tuple[str, int] | None:
    """Return unit and steps a turn of a column that an encoder made; None for another."""
    moved = np.abs(steps[:ROWS_MAX])
    moved = moved[moved > 0.0]
    if len(moved) < 20:
        return None
    step = float(np.percentile(moved, 2))
    times = np.round(moved / step)
    step = float(np.sum(moved) / np.sum(times))
    if np.mean(np.abs(moved / step - times) < 0.1) < 0.98 or len(np.unique(times)) < 2:
        return None
    for name, turn in TURNS.items():
        per_turn = round(turn / step)
        usual = per_turn and (per_turn & (per_turn - 1) == 0 or per_turn % 100 == 0)
        if unit in ("", name) and usual and abs(per_turn * step / turn - 1.0) < 0.005:
            return name, per_turn
    return None


def _with_rate(table: Table, looks: Sequence[Look], place: int) -> Look:
    """Return the look of a column, as a rate where it is the slope of another one."""
    one = looks[place]
    if one.kind not in ("signal", "angle", "rate") or one.missing:
        return one
    values = table.columns[place][:ROWS_MAX]
    for at, other in enumerate(looks):
        if other is one or not other.moves or other.missing:
            continue
        slope = np.gradient(table.columns[at][:ROWS_MAX])
        moving = np.ptp(slope) > 0.0 and np.ptp(values) > 0.0
        if moving and float(np.corrcoef(slope, values)[0, 1]) > RATE_MATCH:
            unit = "" if one.guess else one.unit
            return replace(one, kind="rate", words=f"rate of {other.name}", unit=unit, guess="")
    return one
