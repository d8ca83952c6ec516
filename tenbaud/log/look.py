"""The likely kind of a log's column: a clock, an index, counts, an angle, a command, a signal."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tenbaud.log.angles import step_of, unwrapped
from tenbaud.log.table import Array, Table
from tenbaud.log.units import COUNTS, is_speed, turn_in, unit_named

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
TURNS = {unit: turn_in(unit) or 1.0 for unit in ("deg", "rad")}
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
    """Return the likely kind of every column of a table."""
    return list(_with_rates(table, [_look(table, place) for place in range(len(table.names))]))


def _look(table: Table, place: int) -> Look:
    name, values = table.names[place], table.columns[place]
    unit = unit_named(table.units[place]) or table.units[place]
    there = values[np.isfinite(values)]
    missing = len(values) - len(there)
    if not len(there):
        text = next((text for _, text in table.faults.get(name, ())), "")
        return Look(name, "empty", f"text, such as {text!r}" if text else "no numbers", unit)
    kind, words, supposed = _kind(there, unit)
    guess = ""
    if not unit and supposed:
        unit, _, guess = supposed.partition(": ")
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
    if unit in ("", *TURNS) and (counted := _encoder(values, unit)):
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


def _encoder(values: Array, unit: str) -> tuple[str, int] | None:
    """Return unit and steps a turn of a column that an encoder made; None for another."""
    step = step_of(values)
    for name, turn in TURNS.items():
        per_turn = round(turn / step) if step else 0
        usual = per_turn and (per_turn & (per_turn - 1) == 0 or per_turn % 100 == 0)
        if unit in ("", name) and usual and abs(per_turn * step / turn - 1.0) < 0.005:
            return name, per_turn
    return None


def _with_rates(table: Table, looks: Sequence[Look]) -> Iterator[Look]:
    """Yield the looks of all columns, as a rate where one is the slope of another."""
    columns = [values[:ROWS_MAX] for values in table.columns]
    slopes = {
        one.name: _normal(np.gradient(values))
        for one, values in zip(looks, columns, strict=True)
        if one.moves and not one.missing and len(values) > 1
    }
    for one, values in zip(looks, columns, strict=True):
        if one.kind in ("signal", "angle", "rate") and not one.missing:
            normal = _normal(values)
            for name, slope in slopes.items():
                if name != one.name and float(slope @ normal) > RATE_MATCH:
                    unit = "" if one.guess else one.unit
                    one = replace(one, kind="rate", words=f"rate of {name}", unit=unit, guess="")
                    break
        yield one


def _normal(values: Array) -> Array:
    """Return values about zero, of length one: the product of two is their correlation."""
    about = values - np.mean(values)
    return about / (float(np.linalg.norm(about)) or 1.0)
