"""A run as tables of other libraries, which are imported when they are asked for."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from tenbaud.recording.errors import RecordingError

if TYPE_CHECKING:
    import pandas
    import xarray

    from tenbaud.recording.recorded import RecordedRun


def data_frame(run: RecordedRun) -> pandas.DataFrame:
    """Return a row per tick and a column per signal; units and meanings are in `attrs`."""
    library = _library("pandas", "pandas")
    columns = {name: one.values for name, one in run.signals.items()}
    frame: pandas.DataFrame = library.DataFrame(columns, library.Index(run.time_s, name="time_s"))
    frame.attrs = {
        "units": run.units,
        "descriptions": {name: one.description for name, one in run.signals.items()},
        "preset": run.metadata.get("preset", ""),
    }
    return frame


def data_set(run: RecordedRun) -> xarray.Dataset:
    """Return the signals over `time_s`, units and meanings in the attributes of each."""
    library = _library("xarray", "tenbaud[xarray]")
    variables = {
        name: ("time_s", one.values, {"units": one.unit, "long_name": one.description})
        for name, one in run.signals.items()
    }
    times = {"time_s": ("time_s", run.time_s, {"units": "s", "long_name": "flight time"})}
    found: xarray.Dataset = library.Dataset(
        variables, times, {"preset": run.metadata.get("preset", "")}
    )
    return found


def _library(name: str, requirement: str) -> Any:
    try:
        return import_module(name)
    except ImportError as error:
        raise RecordingError(f"{name} is not installed: pip install '{requirement}'") from error
