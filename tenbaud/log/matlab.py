"""MATLAB's files, v4 to v7.3, as tables: matrices, vectors, structures, and objects with series."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from tenbaud.log.signal_sets import table_of
from tenbaud.log.table import LogError, Table, Wanted, unreadable
from tenbaud.log.variables import variables_of

DEPTH_MAX = 16
"""Of structures in structures; objects may refer to each other in a circle."""
TIME_UNITS_S = {
    "nanoseconds": 1e-9,
    "microseconds": 1e-6,
    "milliseconds": 1e-3,
    "minutes": 60.0,
    "hours": 3600.0,
    "days": 86400.0,
    "weeks": 604800.0,
}
"""Of a `timeseries`; any other is seconds."""


def read_matlab(path: Path, wanted: Wanted | None = None) -> Table:
    """Return the signals in a MATLAB file. LogError where they are none, or of several clocks.

    Objects (`timeseries`, `timetable`, `table`, Simulink's `Dataset`) and files of v7.3 need the
    package mat-io.
    """
    kind, tree = load_matlab(path)
    if isinstance(tree.get("run"), Mapping) and "tick_s" in tree["run"]:
        kind = f"flight exported to a {kind}"
        tree = {name: value for name, value in tree.items() if name not in ("run", "samples", "events")}
    return table_of(path, kind, variables_of(tree), wanted)


def load_matlab(path: Path) -> tuple[str, dict[str, Any]]:
    """Return the file's version in words, and its variables as a tree."""
    from scipy.io import loadmat
    from scipy.io.matlab import matfile_version

    advice = "If MATLAB itself opens it, save the signals anew: save(file, 'name', ..., '-v7')."
    with unreadable(path, "a MATLAB file", advice), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of variables that are no numbers
        major, _ = matfile_version(str(path))
        contents = None if major == 2 else loadmat(path)
        if contents is None or "__function_workspace__" in contents:
            contents = _with_objects(path)
        version = {0: "v4", 1: "v5", 2: "v7.3"}[major]
        tree = {name: _plain(value) for name, value in contents.items() if not name.startswith("__")}
    return f"MATLAB file {version}", tree


def _with_objects(path: Path) -> dict[str, Any]:
    try:
        from matio import load_from_mat
    except ImportError as error:
        raise LogError(
            f"{path} holds MATLAB objects or is of version 7.3, which needs mat-io: pip install "
            "'tenbaud[logs]'. Or save arrays in MATLAB: save(file, 'name', ..., '-v7')."
        ) from error
    contents: dict[str, Any] = load_from_mat(str(path), add_table_attrs=True)
    return contents


def _plain(value: Any, depth: int = 0) -> Any:
    """Return a variable as arrays, texts, mappings by name and lists of these; None for any other."""
    if depth > DEPTH_MAX:
        return None
    if hasattr(value, "properties"):
        return _structure(value.properties, depth)
    if hasattr(value, "columns") and hasattr(value, "index"):
        return _frame(value)
    if isinstance(value, Mapping):
        return _structure(value, depth)
    if not isinstance(value, np.ndarray):
        return value if isinstance(value, str) else None
    if value.dtype.names is not None:
        names = value.dtype.names
        items = [_structure({name: one[name] for name in names}, depth) for one in value.reshape(-1)]
        return items[0] if len(items) == 1 else items
    if value.dtype.kind == "O":
        items = [_plain(one, depth + 1) for one in value.reshape(-1)]
        if len(items) == 1:
            return items[0]
        return [one for one in items if isinstance(one, Mapping)]
    if value.dtype.kind in "US":
        return str(value.reshape(-1)[0]) if value.size == 1 else ""
    return np.ascontiguousarray(value) if value.size <= 1 else value


def _structure(fields: Any, depth: int) -> Any:
    """Return a structure or an object by its fields, those of a series under plain names."""
    if not isinstance(fields, Mapping):
        return None
    tree = {name.strip("_"): _plain(value, depth + 1) for name, value in fields.items()}
    if "Storage" in tree:  # Simulink.SimulationData.Dataset
        return tree["Storage"].get("Elements") if isinstance(tree["Storage"], Mapping) else None
    if "Data" in tree and ("Time" in tree or "TimeInfo" in tree):
        return _series(tree)
    name = tree.get("Name")
    if isinstance(tree.get("Values"), Mapping):  # Simulink.SimulationData.Signal
        named = {"name": name} if isinstance(name, str) and name else {}
        return {**tree["Values"], **named}
    if "values" in tree:
        tree.pop("dimensions", None)
    return tree


def _series(tree: dict[str, Any]) -> dict[str, Any]:
    """Return a `timeseries` as a signal; its times may be given by start and increment alone."""
    info = tree.get("TimeInfo")
    info = info if isinstance(info, Mapping) else {}
    about = tree.get("DataInfo")
    about = about if isinstance(about, Mapping) else {}
    times = tree.get("Time")
    if not isinstance(times, np.ndarray) or times.size == 0:
        start, step, length = (_number(info.get(name)) for name in ("Start", "Increment", "Length"))
        times = start + step * np.arange(int(length)) if step > 0.0 else np.zeros(0)
    unit_s = TIME_UNITS_S.get(str(info.get("Units", "")), 1.0)
    found = {"name": tree.get("Name"), "unit": about.get("Units"), "data": tree["Data"]}
    return {key: value for key, value in found.items() if value is not None} | {
        "time": np.asarray(times, dtype=np.float64).reshape(-1) * unit_s,
        "time_unit": "s",
    }


def _number(value: Any) -> float:
    return float(value.reshape(-1)[0]) if isinstance(value, np.ndarray) and value.size else 0.0


def _frame(frame: Any) -> Any:
    """Return a `table` or `timetable`, which the library makes a data frame."""
    units = frame.attrs.get("varUnits") or frame.attrs.get("VariableUnits") or []
    tree: dict[str, Any] = {}
    if frame.index.dtype.kind in "mM":
        tree["time"] = frame.index.to_numpy()
    for place, name in enumerate(frame.columns):
        values = frame[name].to_numpy()
        if values.dtype.kind in "biufmM":
            unit = units[place] if place < len(units) else ""
            tree[str(name)] = {"values": values, "unit": str(unit), "name": str(name)}
    return tree
