"""One flight in every dialect of text: what is read is always the same."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from channel.codec.models.pitch import PITCH_SIGNALS
from tenbaud.config.schema import FlightLogSection
from tenbaud.log.read import Log, read_log
from tenbaud.log.table import LogError
from tenbaud.log.text import read_text
from tests.tenbaud import lab_files

DIALECTS = lab_files.dialects()


def read(path: Path, **fields: object) -> Log:
    section = FlightLogSection.model_validate({"file": str(path), **fields})
    return read_log(section, PITCH_SIGNALS)


@pytest.mark.parametrize("name", DIALECTS)
def test_a_flight_is_read_alike_however_it_is_written(name: str, tmp_path: Path) -> None:
    text, encoding, end, fields = DIALECTS[name]
    log = read(lab_files.write(tmp_path / "flight.txt", text, encoding, end), **fields)
    _, angle_rad, front_volts, rear_volts = lab_files.flight()
    assert log.tick_s == lab_files.TICK_S
    assert np.abs(log.measured[:, 0] - angle_rad).max() < 3e-5
    assert np.abs(log.commands - np.column_stack([front_volts, rear_volts])).max() < 1e-5
    start_s = {"milli": 5.0, "epoch": 1.7e9}.get(name, 0.0)
    assert log.start_s == pytest.approx(start_s)


def test_a_cell_of_text_leaves_the_other_decimal_commas_and_exponents_alone(tmp_path: Path) -> None:
    rows = [f"{row / 8:.3f};{row}D-01".replace(".", ",") for row in range(200)]
    rows[150:152] = ["18,75;off", "1.875,0;nan"]
    table = read_text(lab_files.write(tmp_path / "log.csv", ["t;angle_deg", *rows]))
    whole = np.delete(np.arange(200), (150, 151))
    np.testing.assert_allclose(table.columns[0][whole], whole / 8)
    np.testing.assert_allclose(table.columns[1][whole], whole / 10)
    assert table.faults == {"t": ((151, "1.875,0"),), "angle_deg": ((150, "off"), (151, "nan"))}


@pytest.mark.parametrize(
    ("count", "said"),
    [("{}", "has no name"), ('"r{}"', "has no name"), ("{}.5", "names 3 of 4 columns")],
)
def test_a_short_header_moves_behind_the_names_of_the_rows(
    tmp_path: Path, count: str, said: str
) -> None:
    rows = [f"{count.format(row)},{row / 50},0.25,3" for row in range(1, 20)]
    table = read_text(lab_files.write(tmp_path / "log.csv", ["time,angle_deg,u", *rows]))
    assert said in table.source
    shifted = table.names == ("1", "time", "angle_deg", "u")
    assert shifted == (said == "has no name")
    assert table.columns[table.find("u")][5] == (3.0 if shifted else 0.25)


@pytest.mark.parametrize(
    "days", ["12.02.2026 13.02.2026", "12/02/2026 13/02/2026", "2/11/2026 2/12/2026"]
)
def test_dates_are_read_with_the_day_where_it_makes_them_rise(days: str, tmp_path: Path) -> None:
    first, second = days.split()
    lines = [f"{first} 23:59:{s},{s}" for s in range(50, 60)]
    lines += [f"{second} 00:00:0{s},{s}" for s in range(5)]
    table = read_text(lab_files.write(tmp_path / "log.csv", ["time,angle", *lines]))
    np.testing.assert_allclose(table.columns[0], np.arange(15.0))


def test_one_input_is_enough_and_the_other_is_zero(tmp_path: Path) -> None:
    rows = lab_files.table()
    rows[:, 2] -= rows[:, 3]
    path = lab_files.write(tmp_path / "one.csv", ["time,angle,u", *lab_files.lines(rows[:, :3])])
    for columns in ({"front": "u"}, {"front": "u", "rear": "0"}, {"input": "u"}, {}):
        log = read(path, columns=columns)
        assert np.abs(log.commands[:, 0] - rows[:, 2]).max() < 1e-5
        assert not log.commands[:, 1].any()
        assert "rear: no column, zero" in log.notes


def test_a_file_of_its_own_signals_says_which_they_are(tmp_path: Path) -> None:
    rows = np.column_stack([lab_files.table(), lab_files.table()[:, 1]])
    path = lab_files.write(
        tmp_path / "own.csv", ["t,Speed [rpm],i_ma,spare,level", *lab_files.lines(rows)]
    )
    section = FlightLogSection(
        file=str(path), columns={"out:speed": "2", "in:current": "i_ma"}, units={"output": "rpm"}
    )
    log = read_log(section, None)
    assert [(one.name, one.unit) for one in log.signals.outputs] == [("speed", "rpm")]
    assert [(one.name, one.unit) for one in log.signals.inputs] == [("current", "A")]
    assert np.abs(log.commands[:, 0] - rows[:, 2] / 1000.0).max() < 1e-5
    guessed = read_log(FlightLogSection(file=str(path)), None)
    assert [one.name for one in guessed.signals.outputs] == ["speed", "level"]
    assert "output level: column level, by its name" in guessed.notes


def test_files_of_one_flight_are_joined_by_time(tmp_path: Path) -> None:
    rows = lab_files.table()
    angles = lab_files.write(tmp_path / "angles.csv", ["t,angle", *lab_files.lines(rows[:, :2])])
    same = lab_files.write(
        tmp_path / "volts.csv", ["t;u1;u2", *lab_files.lines(rows[:, [0, 2, 3]], ";")]
    )
    late = rows[10:, [0, 2, 3]] + (0.005, 0.0, 0.0)
    other = lab_files.write(tmp_path / "late.csv", ["t u1 u2", *lab_files.lines(late, " ")])
    log = read(angles, join=[str(same)])
    assert np.abs(log.commands - rows[:, 2:]).max() < 1e-5
    assert "volts.csv joined row by row" in log.notes
    log = read(angles, join=[str(other)])
    assert (len(log), log.start_s) == (lab_files.ROWS - 11, 0.22)
    # A command is held, and not a value between two.
    assert np.abs(log.commands - rows[10:-1, 2:]).max() < 1e-5
    assert "late.csv joined at the times of the first file" in log.notes
    assert "11 row(s) left out: files before, or late.csv, have none there" in log.notes


def joined(folder: Path, rows: np.ndarray, header: str) -> Log:
    """Return the volts of the flight joined with angles that are written beside them."""
    for place in ("a", "b"):
        (folder / place).mkdir()
    volts = lab_files.lines(lab_files.table()[:, [0, 2, 3]])
    first = lab_files.write(folder / "a/log.csv", ["time_s,u1,u2", *volts])
    second = lab_files.write(folder / "b/log.csv", [header, *lab_files.lines(rows[:, :2])])
    return read(first, join=[str(second)])


def test_each_clock_is_joined_in_its_unit_and_files_may_have_one_name(tmp_path: Path) -> None:
    log = joined(tmp_path, lab_files.table() * (1000.0, 1.0, 1.0, 1.0), "time_ms,angle")
    assert np.abs(log.measured[:, 0] - lab_files.flight()[1]).max() < 1e-5
    assert len(log) == lab_files.ROWS


def test_a_wrapped_angle_is_joined_without_values_between_its_ends(tmp_path: Path) -> None:
    rows = lab_files.table()
    rows[:, 0] += 0.01
    spin = np.linspace(0.0, 20.0, len(rows))
    rows[:, 1] = np.degrees(spin) % 360.0
    log = joined(tmp_path, rows, "time_s,angle_deg")
    assert np.abs(np.diff(log.measured[:, 0]) - spin[1]).max() < 0.6 * spin[1]


def test_a_gap_of_any_joined_file_splits(tmp_path: Path) -> None:
    rows = np.delete(lab_files.table(), slice(500, 550), axis=0)
    with pytest.raises(LogError, match=r"11 s after 9\.98 s.*--from 0 --to 9\.99, --from 11"):
        joined(tmp_path, rows, "time_s,angle")


def test_files_that_do_not_overlap_are_not_joined(tmp_path: Path) -> None:
    with pytest.raises(LogError, match=r"do not overlap in time: log\.csv from 0 to 29\.98 s"):
        joined(tmp_path, np.add(lab_files.table(), (100, 0, 0, 0)), "time_s,angle")
