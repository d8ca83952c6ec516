"""MATLAB's files in every form in which labs save signals, written here as MATLAB writes them."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

from tenbaud.log.matlab import read_matlab
from tenbaud.log.table import LogError, Table, find_column

ROWS = 400
TIME = np.arange(ROWS) * 0.0333
THETA = np.sin(TIME)
VOLTS = np.cos(TIME)
BOTH = np.column_stack([VOLTS, -VOLTS])
VERSIONS = ("v7", "v7.3")


def written(folder: Path, version: str = "5", **variables: Any) -> Path:
    path = folder / "run.mat"
    if version in VERSIONS:
        import matio

        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # durations are written in milliseconds, as MATLAB does
            matio.save_to_mat(str(path), variables, version=version)
    else:
        savemat(path, variables, format=version)
    return path


def series(name: str, values: np.ndarray, unit: str = "", explicit: bool = True) -> Any:
    """Return a `timeseries`, its times as a vector or by start and increment alone."""
    from matio.utils import MatlabOpaque

    about = {
        "Start_": np.array([[0.0]]),
        "Increment_": np.array([[np.nan if explicit else 0.0333]]),
        "Length": np.array([[float(len(values))]]),
        "Units": np.array(["seconds"]),
    }
    fields = {
        "Data_": values.reshape(len(values), -1),
        "Time_": TIME[: len(values), None] if explicit else np.zeros((0, 0)),
        "TimeInfo": MatlabOpaque(about, "tsdata.timemetadata"),
        "DataInfo": MatlabOpaque({"Units": np.array([unit])}, "tsdata.datametadata"),
        "Name": np.array([name]),
    }
    return MatlabOpaque(fields, "timeseries")


def logged(**signals: np.ndarray) -> Any:
    """Return a Simulink Dataset of logged signals."""
    from matio.utils import MatlabOpaque

    elements = np.empty((1, len(signals)), dtype=object)
    for place, (name, values) in enumerate(signals.items()):
        fields = {"Name": np.array([name]), "Values": series("", values)}
        elements[0, place] = MatlabOpaque(fields, "Simulink.SimulationData.Signal")
    storage = MatlabOpaque({"Elements": elements}, "Simulink.SimulationData.Storage.RamDatasetStorage")
    fields = {"Storage_": storage, "Name": np.array(["logsout"])}
    return MatlabOpaque(fields, "Simulink.SimulationData.Dataset")


def scope(with_time: bool = True) -> dict[str, Any]:
    """Return what a Simulink scope saves as "structure with time"."""
    names = ("values", "dimensions", "label", "blockName")
    signals = np.empty((1, 2), dtype=[(name, object) for name in names])
    signals[0, 0] = (THETA[:, None], 1.0, "pitch", "model/Scope")
    signals[0, 1] = (BOTH, 2.0, "", "model/Scope")
    return {"time": TIME[:, None] if with_time else np.zeros((0, 0)), "signals": signals}


def read(path: Path, *names: str) -> Table:
    return read_matlab(path, lambda there, *_: [find_column(str(path), there, one) for one in names])


def check(table: Table, **columns: np.ndarray) -> None:
    assert set(table.names) == {name.replace("__", ".") for name in columns}
    for name, values in columns.items():
        np.testing.assert_allclose(
            table.columns[table.find(name.replace("__", "."))], values, atol=1e-9
        )


@pytest.mark.parametrize("version", ["4", "5", *VERSIONS])
@pytest.mark.parametrize("lying", ["rows", "columns"])
def test_a_matrix_by_number_with_its_clock(tmp_path: Path, version: str, lying: str) -> None:
    matrix = np.vstack([TIME, THETA, VOLTS])
    path = written(tmp_path, version, ans=matrix if lying == "rows" else matrix.T)
    table = read_matlab(path)
    check(table, **{"1": TIME, "2": THETA, "3": VOLTS})
    assert table.roles == {"time": "1"}
    assert f"matrix ans, 3 signals in {lying}, the first is the clock" in table.source


def test_a_matrix_without_a_clock_does_not_name_one(tmp_path: Path) -> None:
    table = read_matlab(written(tmp_path, y=np.column_stack([THETA, BOTH]), Ts=0.0333))
    assert table.roles == {}
    assert "left out: Ts = 0.0333" in table.source


def test_vectors_and_a_matrix_beside_each_other(tmp_path: Path) -> None:
    path = written(tmp_path, tout=TIME, theta=THETA, u=BOTH.T, K=[1.0, 2.0], note="run 3")
    table = read_matlab(path)
    check(table, tout=TIME, theta=THETA, u__1=VOLTS, u__2=-VOLTS)
    assert table.roles == {"time": "tout"}
    assert "left out: K (2 rows)" in table.source


def test_a_structure_of_vectors_and_structures(tmp_path: Path) -> None:
    path = written(tmp_path, data={"t": TIME, "arm": {"theta": THETA}, "u": VOLTS})
    check(read_matlab(path), data__t=TIME, data__arm__theta=THETA, data__u=VOLTS)


def test_a_scope_with_time(tmp_path: Path) -> None:
    table = read_matlab(written(tmp_path, ScopeData=scope()))
    names = {"ScopeData__signals__2__1": VOLTS, "ScopeData__signals__2__2": -VOLTS}
    check(table, ScopeData__time=TIME, pitch=THETA, **names)
    assert table.roles == {"time": "ScopeData.time"}


def test_a_scope_without_time_has_no_clock(tmp_path: Path) -> None:
    assert read_matlab(written(tmp_path, ScopeData=scope(with_time=False))).roles == {}


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("explicit", [True, False])
def test_timeseries_of_one_clock(tmp_path: Path, version: str, explicit: bool) -> None:
    one = series("theta", THETA, "rad", explicit)
    table = read_matlab(written(tmp_path, version, a=one, u=series("unnamed", BOTH)))
    check(table, time=TIME, theta=THETA, u__1=VOLTS, u__2=-VOLTS)
    assert table.units[table.find("theta")] == "rad"
    assert table.roles == {"time": "time"}


@pytest.mark.parametrize("version", VERSIONS)
def test_a_dataset_of_logged_signals(tmp_path: Path, version: str) -> None:
    table = read_matlab(written(tmp_path, version, logsout=logged(theta=THETA, volts=VOLTS)))
    check(table, time=TIME, theta=THETA, volts=VOLTS)


@pytest.mark.parametrize("version", VERSIONS)
def test_tables_and_timetables(tmp_path: Path, version: str) -> None:
    import pandas as pd

    frame = pd.DataFrame({"theta": THETA, "u": VOLTS, "who": ["x"] * ROWS})
    check(read_matlab(written(tmp_path, version, T=frame)), theta=THETA, u=VOLTS)
    timed = frame[["theta", "u"]].set_index(pd.to_timedelta(TIME, unit="s"))
    table = read_matlab(written(tmp_path, version, T=timed))
    check(table, T__time=TIME, theta=THETA, u=VOLTS)
    assert (table.roles, table.units[0]) == ({"time": "T.time"}, "s")


def test_several_lengths_are_chosen_by_name(tmp_path: Path) -> None:
    path = written(tmp_path, theta=THETA, u=VOLTS, ref=THETA[:250])
    with pytest.raises(
        LogError, match=r"theta, u \(400 rows\); ref \(250 rows\).*--columns output=theta"
    ):
        read_matlab(path)
    table = read(path, "u", "theta")
    check(table, u=VOLTS, theta=THETA)
    assert "left out: ref (250 rows)" in table.source


def test_series_of_two_clocks_are_two_sets(tmp_path: Path) -> None:
    path = written(tmp_path, "v7", a=series("theta", THETA), b=series("u", VOLTS[::2]))
    with pytest.raises(LogError, match="2 sets of signals"):
        read_matlab(path)
    check(read(path, "theta"), theta=THETA)


@pytest.mark.parametrize(
    ("variables", "said"),
    [({}, "holds no signals"), ({"K": 3.0}, "holds no signals; it holds K = 3")],
)
def test_a_file_without_signals_says_what_it_holds(
    tmp_path: Path, variables: dict[str, Any], said: str
) -> None:
    with pytest.raises(LogError, match=said):
        read_matlab(written(tmp_path, **variables))


def test_a_damaged_file_says_how_to_save_it_anew(tmp_path: Path) -> None:
    path = written(tmp_path, theta=THETA)
    path.write_bytes(path.read_bytes()[:200])
    with pytest.raises(LogError, match=r"cannot be read as a MATLAB file.*save\(file"):
        read_matlab(path)


def test_without_the_library_the_error_names_the_extra(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = written(tmp_path, "v7.3", theta=THETA)
    monkeypatch.setitem(__import__("sys").modules, "matio", None)
    with pytest.raises(LogError, match=r"pip install 'tenbaud\[logs\]'"):
        read_matlab(path)
