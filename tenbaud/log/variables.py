"""The named arrays of a file: which of them are signals, and over which clock.

MATLAB, NumPy and TDMS files and messages of other programs are read into nested mappings of arrays;
here these become variables, each with the clock beside it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tenbaud.log.table import Array
from tenbaud.log.units import CLOCK_WORDS, stem_of

Tree = Mapping[str, Any]
"""Names to arrays, texts, trees, and lists of these."""

DATA_NAMES = frozenset({"data", "value", "values"})
"""Names of the array of a signal that is a structure."""
UNNAMED = frozenset({"", "unnamed"})
COLUMNS_MAX = 256
"""Of one matrix; more are an image or a simulation, not a log."""
ROWS_MIN = 2


@dataclass(frozen=True, slots=True)
class Clock:
    """The times of some variables, in the order of their rows."""

    name: str
    values: Array
    unit: str = ""


@dataclass(frozen=True, slots=True)
class Variable:
    """An array of the file: rows are instants, columns signals, once `rows_first` has turned it."""

    name: str
    values: NDArray[Any]
    unit: str = ""
    clock: Clock | None = None


def variables_of(tree: Tree, path: str = "", above: Clock | None = None) -> Iterator[Variable]:
    """Yield every numeric array of a tree under its dotted name, with the clock that belongs to it.

    A clock is an array beside the others whose name says so. A structure whose one array is called
    `data` or `value` is one signal: its name is the structure's, or what it calls itself.
    """
    texts = {key: value for key, value in tree.items() if isinstance(value, str)}
    arrays = {key: value for key, value in tree.items() if _is_numeric(value)}
    data = [key for key in arrays if key.lower() in DATA_NAMES]
    own = next((texts[key] for key in ("name", "label") if texts.get(key, "") not in UNNAMED), path)
    clock, clock_key = above, ""
    for key in arrays:
        if stem_of(key) in CLOCK_WORDS and _is_vector(arrays[key]):
            name = key if len(data) == 1 else _dotted(path, key)
            unit = "s" if arrays[key].dtype.kind in "mM" else texts.get("time_unit", "")
            clock, clock_key = Clock(name, seconds(arrays[key]), unit), key
            break
    for name, value in tree.items():
        if name in arrays and name != clock_key:
            is_signal = data == [name] and own
            called = own if is_signal else _dotted(path, name)
            yield Variable(called, value, texts.get("unit", "") if is_signal else "", clock)
        elif isinstance(value, Mapping):
            yield from variables_of(value, _dotted(path, name), clock)
        elif isinstance(value, list):
            for number, item in enumerate(value, start=1):
                yield from variables_of(item, _dotted(path, f"{name}.{number}"), clock)


def seconds(values: NDArray[Any]) -> Array:
    """Return an array of one column as numbers, dates and durations in seconds."""
    values = values.reshape(-1)
    if values.dtype.kind == "m":
        return np.asarray(values / np.timedelta64(1, "s"), dtype=np.float64)
    if values.dtype.kind == "M":
        return seconds(values - np.datetime64("1970-01-01T00:00:00"))
    return np.asarray(values, dtype=np.float64)


def rows_first(values: NDArray[Any], rows: int | None) -> Array | None:
    """Return an array with a row per instant; None if it is not a table of signals.

    `rows` is the length of its clock. Without one the longer axis is time.
    """
    values = values.reshape([size for size in values.shape if size != 1] or [1])
    if values.ndim == 1:
        return None if rows not in (None, len(values)) else seconds(values)[:, None]
    if rows is None and values.ndim == 2:
        rows = max(values.shape)
    axis = next((axis for axis, size in enumerate(values.shape) if size == rows), None)
    if axis is None or rows is None or values.size // rows > COLUMNS_MAX:
        return None
    return np.asarray(np.moveaxis(values, axis, 0).reshape(rows, -1), dtype=np.float64)


def _dotted(path: str, name: str) -> str:
    return f"{path}.{name}" if path and name else path or name


def _is_numeric(value: Any) -> bool:
    return isinstance(value, np.ndarray) and value.dtype.kind in "biufmM" and value.size > 0


def _is_vector(value: NDArray[Any]) -> bool:
    return value.size == max(value.shape, default=1) >= ROWS_MIN
