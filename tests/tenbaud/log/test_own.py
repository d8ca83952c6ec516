"""The tool's own runs and exports are logs of which nothing has to be said."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from channel.codec.models.pitch import PITCH_SIGNALS
from tenbaud import Run
from tenbaud.config.schema import FlightLogSection
from tenbaud.log.read import read_log
from tenbaud.log.reader import read_table
from tenbaud.log.table import LogError, export_roles
from tenbaud.recording.convert import FORMS, convert
from tenbaud.recording.reader import Recording
from tenbaud.recording.writer import McapRecorder
from tests.tenbaud.flown import flown


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    return flown(tmp_path_factory.mktemp("runs") / "pitch", duration_s=3.0)


@pytest.fixture(scope="module")
def two(tmp_path_factory: pytest.TempPathFactory) -> Run:
    return flown(tmp_path_factory.mktemp("runs") / "two", "aero-20baud", duration_s=1.0)


def check(path: Path, run: Run) -> None:
    """The columns that the roles name are the flight's own signals: outputs as measured."""
    table = read_table(path)
    outputs = [one.name for one in run.plant.outputs]
    inputs = [one.name for one in run.plant.inputs]
    clocks = {"time", "index"} & set(table.roles)
    assert len(clocks) == 1
    roles = [f"out:{name}" for name in outputs] + [f"in:{name}" for name in inputs]
    assert [role for role in table.roles if role not in clocks] == roles
    measured = ["measured"] if len(outputs) == 1 else [f"measured_{name}" for name in outputs]
    for role, name in zip(roles, [*measured, *inputs], strict=True):
        column = table.columns[table.find(table.roles[role])]
        np.testing.assert_array_equal(column, run.values_of(name))
    clock = table.columns[table.find(table.roles[clocks.pop()])]
    times = clock * table.period_s if table.period_s else clock
    np.testing.assert_allclose(times, run.time_s, atol=1e-12)


def test_a_run_as_measured_and_applied(run: Run, two: Run) -> None:
    check(run.path, run)
    check(run.path / "transmitter.mcap", run)
    check(two.path, two)


@pytest.mark.parametrize("form", FORMS)
def test_every_export(run: Run, form: str, tmp_path: Path) -> None:
    convert(run, form, tmp_path / f"flight.{form}")
    check(tmp_path / f"flight.{form}", run)


def test_a_run_is_a_log_for_another_model_by_its_columns(two: Run) -> None:
    table = read_table(two.path)
    columns = {"angle": table.names[1], "front": "4", "rear": "5"}
    log = read_log(FlightLogSection(file=str(two.path), columns=columns), PITCH_SIGNALS)
    np.testing.assert_array_equal(log.measured[:, 0], table.columns[1])
    assert any("is no signal of the model" in note for note in log.notes)


@pytest.mark.parametrize("form", FORMS)
def test_every_export_of_two_outputs(two: Run, form: str, tmp_path: Path) -> None:
    convert(two, form, tmp_path / f"flight.{form}")
    check(tmp_path / f"flight.{form}", two)


def test_ticks_without_a_reading_are_left_out_and_the_index_shows_it(run: Run, tmp_path: Path) -> None:
    rows = iter(read_table(run.path).columns[0].tolist())
    missing = {7, 8, 40}
    path = tmp_path / "transmitter.mcap"
    channel = run.table("transmitter", "tick").channel
    with McapRecorder(path, run.metadata, wait_when_full=True) as recorder:
        for time_ns, row in Recording(run.path / "transmitter.mcap").rows("tick"):
            if row["tick"] in missing:
                row = {**row, "measured": None}
            recorder.write(channel, time_ns, tuple(row[name] for name in row))
    table = read_table(path)
    index = table.columns[table.find("tick")].tolist()
    assert index == [tick for tick in rows if tick not in missing]
    assert table.place(7) == "tick 9"


def test_a_receivers_recording_measured_nothing(run: Run, tmp_path: Path) -> None:
    shutil.copy(run.path / "receiver.mcap", tmp_path)
    with pytest.raises(LogError, match=r"no measured angles.*transmitter\.mcap"):
        read_table(tmp_path)


def test_a_folder_without_a_run_and_other_json(tmp_path: Path) -> None:
    with pytest.raises(LogError, match=r"holds neither transmitter\.mcap"):
        read_table(tmp_path)
    (tmp_path / "log.json").write_text('{"theta": [1, 2]}')
    with pytest.raises(LogError, match="no flight that `tenbaud convert` wrote"):
        read_table(tmp_path / "log.json")


def test_columns_of_another_file_have_no_roles() -> None:
    names = ("time_s", "pitch", "measured", "front_command", "front")
    assert export_roles(names, [""] * len(names)) == {}
