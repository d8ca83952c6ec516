"""Values that a program passes to `fly`: gains, set-points, classes; as settings and as parts."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from channel.codec.signals import Signal
from tenbaud.config.controllers import ReferenceSection
from tenbaud.config.load import ConfigError
from tenbaud.files.whole import write_whole

Set: TypeAlias = "float | ArrayLike | tuple[ArrayLike, ArrayLike] | Callable[[float], Any]"
"""Set-points: numbers, a row for each tick, (times, values), or a function of the time in seconds."""
Given: TypeAlias = "Set | Mapping[str, Any]"
"""That, or fields of `receiver.reference` and set-points by the names of outputs."""
Table = NDArray[np.float64]
FORMS = (
    "give a number, an array with a row for each tick, (times, values), a function of the time, or a "
    "table by the names of the outputs"
)


def feedback_gains(given: Any) -> list[list[float]]:
    """Return the gains of u = -K x, a row for each input; ConfigError if it is not a matrix."""
    try:
        gains = np.atleast_2d(np.asarray(given, dtype=float))
    except (TypeError, ValueError) as error:
        raise ConfigError(
            f"controller: {error}; give a matrix of gains, a row for each input"
        ) from error
    if gains.ndim != 2 or not np.isfinite(gains).all():
        raise ConfigError(
            f"controller: the gains {gains.tolist()} must be finite, a row for each input"
        )
    return [[float(value) for value in row] for row in gains]


def reference_settings(
    given: Any, outputs: Sequence[Signal], ticks: int, tick_s: float, file: Path
) -> dict[str, Any]:
    """Return the section `receiver.reference`; values over time are written into `file`.

    ConfigError, naming the output, for set-points that are none.
    """
    by_output = {one.name: place for place, one in enumerate(outputs)}
    tables: dict[int, Table] = {}
    section: dict[str, Any] = {}
    if not isinstance(given, Mapping):
        shape = None if callable(given) or _is_pair(given) else np.shape(given)
        if shape in ((), (len(outputs),)):
            values = np.atleast_1d(given)
            return {one.name: _constant(value) for one, value in zip(outputs, values, strict=False)}
        table = _over_time(given, len(outputs), ticks, tick_s)
        tables = dict(enumerate(table.T))
    for name, one in given.items() if isinstance(given, Mapping) else ():
        if name not in by_output and name not in ReferenceSection.model_fields:
            raise ConfigError(f"reference: {name!r} is none of the outputs: {', '.join(by_output)}")
        if name not in by_output or isinstance(one, Mapping):
            section[name] = one
        elif not callable(one) and np.shape(one) == ():
            section[name] = _constant(one)
        else:
            tables[by_output[name]] = _over_time(one, 1, ticks, tick_s)[:, 0]
    if tables:
        _write(file, {outputs[place]: values for place, values in tables.items()}, tick_s)
    return section | {outputs[at].name: {"kind": "csv", "file": str(file)} for at in tables}


def whole_sections(given: Mapping[str, Any], first: str) -> dict[str, Any]:
    """Return given sections of `receiver.reference` so that they replace what is configured.

    One with a kind has all its fields then, offset included; fields without a kind only change some.
    `first` is the output whose set-point is the section itself, unless that is under its name.
    """
    usual = ReferenceSection().model_dump()
    named = {name: one for name, one in given.items() if name not in usual}
    if "kind" in given:
        named = {first: {name: one for name, one in given.items() if name in usual}} | named
    whole = {
        name: {**usual, **one} if isinstance(one, Mapping) and "kind" in one else one
        for name, one in named.items()
    }
    return whole if "kind" in given else {**given, **whole}


def _constant(value: Any) -> dict[str, Any]:
    try:
        return {"kind": "constant", "amplitude": float(value)}
    except (TypeError, ValueError) as error:
        raise ConfigError(f"reference: {error}; {FORMS}") from error


def _over_time(given: Any, outputs: int, ticks: int, tick_s: float) -> Table:
    """Return a row for each tick and a column for each output, from the first."""
    try:
        if callable(given):
            rows = [np.atleast_1d(given(tick * tick_s)) for tick in range(ticks)]
            table = np.array(rows, dtype=float)
        elif _is_pair(given):
            times = np.asarray(given[0], dtype=float)
            values = _columns(given[1])
            if times.shape != (len(values),) or not (np.diff(times) > 0.0).all():
                raise ValueError(f"{times.size} rising times are needed for {len(values)} rows")
            first = np.ceil(times / tick_s - 1e-6)
            at = np.searchsorted(first, np.arange(ticks), side="right") - 1
            table = values[np.maximum(at, 0)]
        else:
            values = _columns(given)
            table = values[np.minimum(np.arange(ticks), len(values) - 1)]
    except (TypeError, ValueError, IndexError) as error:
        raise ConfigError(f"reference: {error}; {FORMS}") from error
    if table.ndim != 2 or not 1 <= table.shape[1] <= outputs:
        raise ConfigError(
            f"reference has {table.shape[-1]} values at a time, and there are {outputs} output(s)"
        )
    return table


def _is_pair(given: Any) -> bool:
    return isinstance(given, tuple) and len(given) == 2 and np.ndim(given[0]) == 1


def _columns(values: Any) -> Table:
    table = np.asarray(values, dtype=float)
    return table[:, None] if table.ndim == 1 else table


def _write(file: Path, columns: Mapping[Signal, Table], tick_s: float) -> None:
    """Write the set-points as a file for the `csv` reference, a row where one of them changes."""
    table = np.column_stack(list(columns.values()))
    for tick, place in np.argwhere(~np.isfinite(table))[:1]:
        raise ConfigError(
            f"reference of {list(columns)[place].name} is {table[tick, place]} at {tick * tick_s:g} s; "
            "it must be finite"
        )
    changed = np.flatnonzero(np.r_[True, (np.diff(table, axis=0) != 0.0).any(axis=1)])
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["time_s", *(one.column for one in columns)])
    writer.writerows([repr(float(tick * tick_s)), *map(repr, table[tick].tolist())] for tick in changed)
    write_whole(file, text.getvalue())
