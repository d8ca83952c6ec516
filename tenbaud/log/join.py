"""Several files of one flight, joined by time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from tenbaud.log.table import Array, LogError, Table, Wanted, find_column, listed
from tenbaud.log.units import CLOCK_WORDS, stem_of

SAME = 1e-3
"""Difference of two clocks, in steps, up to which their rows are the same."""


def read_joined(
    paths: Sequence[str | Path], read: Callable[[Path], Table], time: str, wanted: Wanted | None
) -> tuple[Table, tuple[str, ...]]:
    """Return the columns of all files at the times of the first, and what was done for people.

    A column whose name an earlier file has gets the name of its file before it. `time` is the clock
    of every file, "" where its name says so.
    """
    tables = [read(Path(path)) for path in paths]
    first = tables[0]
    clock = _clock(first, time)
    names, units, columns = list(first.names), list(first.units), list(first.columns)
    notes = []
    for table in tables[1:]:
        own = _clock(table, time)
        same = len(own) == len(clock) and np.allclose(own, clock, rtol=0.0, atol=SAME * _step(clock))
        stem = Path(table.path).stem
        for name, unit, values in zip(table.names, table.units, table.columns, strict=True):
            if values is own:
                continue
            names.append(name if name not in names else f"{stem}.{name}")
            units.append(unit)
            columns.append(values if same else np.interp(clock, own, values, np.nan, np.nan))
        how = "row by row" if same else "by linear interpolation at the times of the first file"
        notes.append(f"{Path(table.path).name} joined {how}")
    if len(set(names)) < len(names):
        raise LogError(
            f"{first.path}: joined files of one name hold columns of one name: {listed(names)}"
        )
    places = list(wanted(names, units, first.roles) if wanted else range(len(names)))
    joined = replace(
        first,
        names=tuple([names[place] for place in places]),
        units=tuple([units[place] for place in places]),
        columns=tuple([columns[place] for place in places]),
    )
    return joined, tuple(notes)


def _clock(table: Table, time: str) -> Array:
    """Return the clock of a file, checked."""
    named = time or table.roles.get("time", "")
    if named:
        place = find_column(table.path, table.names, named)
    else:
        found = [at for at, name in enumerate(table.names) if stem_of(name) in CLOCK_WORDS]
        if not found:
            raise LogError(
                f"{table.path}: which column is the time? Files are joined by it: give "
                f"--columns time=NAME, the same in every file; present: {listed(table.names)}"
            )
        place = found[0]
    values = table.check(place)
    if len(values) < 2 or np.any(np.diff(values) <= 0.0):
        raise LogError(
            f"{table.path}, column {table.names[place]}: the times do not rise; no file joins"
        )
    return values


def _step(clock: Array) -> float:
    return float(np.median(np.diff(clock)))
