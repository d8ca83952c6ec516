"""The clock of a log: times in seconds, cut intervals, and rows one tick apart."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from tenbaud.log.table import Array, LogError, Table
from tenbaud.log.units import DATE_TIME, factor

EVEN = 0.05
"""Deviation from even sampling, in steps, up to which rows are taken as they are."""
ROUND = 0.005
"""Share by which the tick of resampled rows may differ from their mean step, to be round."""
GAP = 2.5
"""Steps between two rows from which they are no longer joined by interpolation."""
STRETCHES_MAX = 6


@dataclass(frozen=True)
class Clock:
    """Times of the rows that are used."""

    rows: slice
    times_s: Array | None
    """of those rows where they are to be resampled; None: they are one tick apart"""
    tick_s: float
    start_s: float
    count: int
    """of ticks"""
    notes: tuple[str, ...] = ()

    def line(self, values: Array) -> Array:
        """Return values at every tick, by linear interpolation."""
        if self.times_s is None:
            return values
        return np.interp(self._grid, self.times_s, values).astype(np.float64)

    def held(self, values: Array) -> Array:
        """Return values at every tick, each held until the next row."""
        if self.times_s is None:
            return values
        late = self._grid + 1e-6 * self.tick_s
        rows = np.searchsorted(self.times_s, late, side="right") - 1
        return values[np.maximum(rows, 0)]

    @property
    def _grid(self) -> Array:
        return np.float64(self.start_s) + np.arange(self.count) * np.float64(self.tick_s)


def by_period(rows: int, period_s: float, start_s: float | None, end_s: float | None) -> Clock:
    """Return the clock of rows that are one period apart."""
    first = 0 if start_s is None else max(0, int(np.ceil(start_s / period_s - 1e-6)))
    last = rows if end_s is None else min(rows, int(np.ceil(end_s / period_s - 1e-6)))
    return Clock(slice(first, last), None, period_s, first * period_s, max(0, last - first))


def has_fractions(values: Array) -> bool:
    """Return whether some of the numbers that are there are not whole."""
    return bool(np.any((values != np.floor(values)) & np.isfinite(values)))


def counts_rows(values: Array) -> bool:
    """Return whether numbers are whole and lie a whole number of their usual steps apart."""
    steps = np.diff(values[np.isfinite(values)])
    usual = float(np.median(steps)) if len(steps) else 0.0
    return not has_fractions(values) and usual > 0.0 and not np.any(steps % usual)


def by_index(
    table: Table, column: int, period_s: float, start_s: float | None, end_s: float | None
) -> Clock:
    """Return the clock of rows that whole numbers count.

    A table that has its own period counts in it; in another one the usual step is a period.
    """
    step = float(np.nanmedian(np.diff(table.columns[column]))) if len(table) > 1 else 1.0
    by = period_s if table.period_s is not None or step <= 0.0 else period_s / step
    return by_time(table, column, by, 0.0, "s", start_s, end_s, step * by)


def by_time(
    table: Table,
    column: int,
    scale: float,
    offset: float,
    unit: str,
    start_s: float | None,
    end_s: float | None,
    tick_s: float | None = None,
) -> Clock:
    """Return the clock of rows with a time each; `unit` is as given, "" unknown."""
    times = (scale * table.columns[column] + offset) * seconds_in(table, unit)
    rows = _cut(table, times, start_s, end_s)
    table.check(column, rows)
    times = times[rows]
    if len(times) < 2:
        return Clock(rows, None, 1.0, float(times[0]) if len(times) else 0.0, len(times))
    steps = np.diff(times)
    usual = float(np.median(steps))
    _check_rising(table, column, rows, steps, usual)
    if not unit and usual >= 1.0:
        raise without_unit(table, column, usual)
    _check_gaps(table, column, rows, times, steps, usual)
    return _even(rows, times, unit, tick_s)


def seconds_in(table: Table, unit: str) -> float:
    """Return the seconds of a unit of time; LogError where it is none."""
    by = 1.0 if unit == DATE_TIME else factor(unit, "s")
    if by is None:
        raise LogError(f"{table.path}: the unit of the time is {unit!r}; give s, ms, us or ns")
    return by


def without_unit(table: Table, column: int, step: float) -> LogError:
    """Return the error of a clock that may count seconds, parts of them, or the rows."""
    name = table.names[column]
    return LogError(
        f"{table.path}, column {name}: the clock rises by {step:g} a row; say in which unit: "
        f"--units time=ms, us, ns or s; if it counts the rows: --columns index={name} and "
        "--period SECONDS"
    )


def shown(time_s: float, step_s: float) -> str:
    """Return a time with the digits that tell it from those one step before and after."""
    if not step_s > 0.0:
        return f"{time_s:.12g}"
    text = f"{time_s:.{max(1, 2 - math.floor(math.log10(step_s)))}f}"
    return text.rstrip("0").rstrip(".")


def _cut(table: Table, times: Array, start_s: float | None, end_s: float | None) -> slice:
    first, last = 0, len(times)
    if start_s is None and end_s is None:
        return slice(first, last)
    step = float(np.nanmedian(np.diff(times))) if len(times) > 1 else 0.0
    near = max(1e-9, 0.01 * step)  # times are shown rounded
    if start_s is not None:
        first = int(np.argmax(times >= start_s - near)) if np.any(times >= start_s - near) else last
    if end_s is not None:
        after = np.flatnonzero(times[first:] >= end_s - near)
        last = first + int(after[0]) if len(after) else last
    if first >= last and len(times):
        raise LogError(
            f"{table.path}: no row from {start_s if start_s is not None else 'the start'} to "
            f"{end_s if end_s is not None else 'the end'} s; the file's clock runs from "
            f"{shown(np.nanmin(times), step)} to {shown(np.nanmax(times), step)} s"
        )
    return slice(first, last)


def _check_rising(table: Table, column: int, rows: slice, steps: Array, usual: float) -> None:
    if usual <= 0.0:
        raise LogError(
            f"{table.path}, column {table.names[column]}: the times do not rise; is it the right "
            "column? --columns time=NAME says which is"
        )
    back = np.flatnonzero(steps <= 0.0)
    if len(back):
        row = int(back[0]) + 1
        what = "the same time as in the row before" if steps[row - 1] == 0.0 else "the time runs back"
        more = f" (and at {len(back) - 1} other rows)" if len(back) > 1 else ""
        raise table.fault(
            rows.start + row,
            column,
            f"{what}{more}; delete the row, or choose a stretch with --from and --to",
        )


def _check_gaps(
    table: Table, column: int, rows: slice, times: Array, steps: Array, usual: float
) -> None:
    gaps = np.flatnonzero(steps > GAP * usual)
    if not len(gaps):
        return
    row = int(gaps[0])
    edges = [0, *(gaps + 1).tolist(), len(times)]
    stretches = sorted(pairwise(edges), key=lambda one: one[0] - one[1])
    options = ", ".join(
        f"--from {shown(times[first], usual)} --to {shown(times[last - 1] + usual / 2, usual)}"
        for first, last in sorted(stretches[:STRETCHES_MAX])
        if last - first > 1
    )
    raise table.fault(
        rows.start + row + 1,
        column,
        f"{shown(times[row + 1], usual)} s after {shown(times[row], usual)} s, where the usual step is "
        f"{usual:g} s; choose one of the {len(edges) - 1} stretches between the gaps: {options}",
    )


def _even(rows: slice, times: Array, unit: str, known_s: float | None) -> Clock:
    """Return the clock with an even tick, the known one if any; resampled where rows are off it."""
    count, start = len(times), float(times[0])
    mean = float(times[-1] - start) / (count - 1)
    tick_s = known_s or float(f"{mean:.3g}")
    if known_s is None and abs(tick_s - mean) * (count - 1) > 0.5 * mean:
        tick_s = round(mean, 9) or mean
    notes = []
    if unit == DATE_TIME:
        notes.append("the clock is a column of dates: its seconds count from the first")
    off = float(np.max(np.abs(times - start - np.arange(count) * tick_s)))
    if off <= EVEN * tick_s:
        return Clock(rows, None, tick_s, start, count, tuple(notes))
    # Rows are put on a grid of their own times, so that the tick may be a round one.
    near = [float(f"{mean:.{digits}g}") for digits in (1, 2, 3)]
    tick_s = known_s or next((one for one in near if abs(one - mean) <= ROUND * mean), mean)
    ticks = int((times[-1] - start) / tick_s + 1e-6) + 1
    places = (times - start) / tick_s
    jitter = float(np.max(np.abs(places - np.round(places)))) * tick_s
    if jitter > EVEN * tick_s:
        notes.append(f"resampled to {tick_s:g} s: the times of the rows jitter by up to {jitter:.2g} s")
    if ticks > count:
        notes.append(f"{ticks - count} row(s) lost, filled by interpolation")
    return Clock(rows, times, tick_s, start, ticks, tuple(notes))
