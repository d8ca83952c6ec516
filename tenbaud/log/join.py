"""Several files of one flight, joined by time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from tenbaud.config.schema import FlightLogSection
from tenbaud.log.clock import GAP, seconds_in, shown, without_unit
from tenbaud.log.reader import Reader
from tenbaud.log.table import Array, LogError, Table, Wanted, find_column, listed
from tenbaud.log.units import CLOCK_WORDS, DATE_TIME, stem_of

SAME = 1e-3
"""Difference of two clocks, in steps, up to which their rows are the same."""
SEAM = 0.5
"""Share of a column's range from which a step between two rows is not interpolated."""


def table_of(
    section: FlightLogSection,
    read: Reader,
    wanted: Wanted | None = None,
    held: Callable[[], Sequence[int | None]] = lambda: (),
) -> tuple[Table, tuple[str, ...]]:
    """Return the columns of a log, of all its files at the times of the first, and what was done.

    A column whose name an earlier file has gets the name of its file before it. `held` gives
    the places of columns that hold their value until the next row, once `wanted` has chosen.
    """
    if not section.join:
        return read(section.file, wanted), ()
    tables = [read(path, None) for path in (section.file, *section.join)]
    time, unit = (names.get("time", "") for names in (section.columns, section.units))
    first = tables[0]
    clocks = [_clock(table, time, unit) for table in tables]
    names, units, sources = _all_columns(tables, [place for place, _ in clocks])
    places = list(wanted(names, units, first.roles) if wanted else range(len(names)))
    clock = clocks[0][1]
    kept = np.ones(len(clock), dtype=bool)
    notes = []
    same = [True]
    for table, (_, own) in zip(tables[1:], clocks[1:], strict=True):
        name = Path(table.path).name
        same.append(
            len(own) == len(clock) and np.allclose(own, clock, rtol=0.0, atol=SAME * _step(clock))
        )
        how = "row by row" if same[-1] else "at the times of the first file"
        notes.append(f"{name} joined {how}")
        if not same[-1]:
            kept &= _covered(clock, own)
            if left := len(kept) - int(kept.sum()):
                notes.append(f"{left} row(s) left out: files before, or {name}, have none there")
    if kept.sum() < 2:
        spans = [
            f"{Path(table.path).name} from {shown(own[0], _step(own))} to "
            f"{shown(own[-1], _step(own))} s"
            for table, (_, own) in zip(tables, clocks, strict=True)
        ]
        raise LogError(f"{first.path}: joined files do not overlap in time: {'; '.join(spans)}")
    rows = np.flatnonzero(kept)
    holds = set(held())
    columns = []
    for number, at in (sources[place] for place in places):
        values = tables[number].columns[at]
        if same[number]:
            columns.append(values if kept.all() else values[rows])
        else:
            is_held = sources.index((number, at)) in holds
            columns.append(_at(clock[rows], clocks[number][1], values, is_held))
    joined = replace(
        first,
        names=tuple([names[place] for place in places]),
        units=tuple([units[place] for place in places]),
        columns=tuple(columns),
        place=lambda row: first.place(int(rows[row])),
        faults={
            name: tuple((int(np.searchsorted(rows, row)), text) for row, text in cells if kept[row])
            for name, cells in first.faults.items()
        },
    )
    return joined, tuple(notes)


def _all_columns(
    tables: Sequence[Table], clocks: Sequence[int]
) -> tuple[list[str], list[str], list[tuple[int, int]]]:
    """Return names and units of all columns, later clocks apart, and each one's table and place."""
    names: list[str] = []
    units: list[str] = []
    sources: list[tuple[int, int]] = []
    for number, (table, place) in enumerate(zip(tables, clocks, strict=True)):
        stem = Path(table.path).stem
        for at, name in enumerate(table.names):
            if number and at == place:
                continue
            names.append(f"{stem}.{name}" if number and name in names else name)
            units.append(table.units[at])
            sources.append((number, at))
    if len(set(names)) < len(names):
        raise LogError(
            f"{tables[0].path}: joined files of one name hold columns of one name: {listed(names)}"
        )
    return names, units, sources


def _covered(clock: Array, own: Array) -> npt.NDArray[np.bool_]:
    """Return which times lie between two rows of another clock that is without a gap there."""
    near = SAME * _step(own)
    before = np.clip(np.searchsorted(own, clock + near, side="right") - 1, 0, len(own) - 2)
    steps = np.diff(own)
    inside = (clock >= own[0] - near) & (clock <= own[-1] + near)
    on_row = np.minimum(np.abs(clock - own[before]), np.abs(clock - own[before + 1])) <= near
    covered: npt.NDArray[np.bool_] = inside & (on_row | (steps[before] <= GAP * _step(own)))
    return covered


def _at(times: Array, own: Array, values: Array, held: bool) -> Array:
    """Return values at other times: held, or interpolated but for steps such as a wrapped angle's."""
    late = times + SAME * _step(own)
    before = np.clip(np.searchsorted(own, late, side="right") - 1, 0, len(own) - 1)
    if held:
        return values[before]
    after = np.minimum(before + 1, len(own) - 1)
    seam = np.abs(values[after] - values[before]) > SEAM * np.ptp(values)
    nearest = np.where(times - own[before] <= own[after] - times, before, after)
    return np.where(seam, values[nearest], np.interp(times, own, values))


def _clock(table: Table, time: str, unit: str) -> tuple[int, Array]:
    """Return the place of a file's clock, and its times in seconds, checked."""
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
    unit = unit or table.units[place]
    if unit == DATE_TIME:
        raise LogError(
            f"{table.path}, column {table.names[place]}: dates count from the first row of each file; "
            "to join files, save the times as seconds from one start"
        )
    if not unit and _step(values) >= 1.0:
        raise without_unit(table, place, _step(values))
    return place, values * seconds_in(table, unit)


def _step(clock: Array) -> float:
    return float(np.median(np.diff(clock)))
