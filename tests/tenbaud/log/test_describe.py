"""`tenbaud log`: what is said about a file, and whether the options that it suggests are right."""

from __future__ import annotations

import json
import math
import tomllib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat
from typer.testing import CliRunner, Result

from tenbaud.cli.commands import app
from tenbaud.config.schema import FlightLogSection
from tenbaud.log.describe import Description, describe

ROWS = 600
TIME = np.arange(ROWS) * 0.02
ANGLE = 1.2 * np.sin(1.3 * TIME)
STEP = math.tau / 4096
READ = np.floor(ANGLE / STEP) * STEP
VOLTS = np.where(TIME % 2.0 < 1.0, 3.0, -3.0)


def csv(path: Path, **columns: np.ndarray) -> Path:
    rows = zip(*columns.values(), strict=True)
    lines = [",".join(columns), *(",".join(f"{cell:.8g}" for cell in row) for row in rows)]
    path.write_text("\n".join(lines) + "\n")
    return path


def described(path: Path, **fields: object) -> Description:
    return describe(FlightLogSection.model_validate({"file": str(path), **fields}))[0]


def command(*words: object) -> Result:
    return CliRunner().invoke(app, ["log", *map(str, words)])


def looks(found: Description) -> dict[str, str]:
    return {one.name: one.words for one in found.looks}


@pytest.fixture
def plain(tmp_path: Path) -> Path:
    return csv(tmp_path / "log.csv", time=TIME, angle=READ, u1=VOLTS, u2=0.0 * TIME)


def test_names_are_taken_first_and_the_options_say_so(plain: Path) -> None:
    found = described(plain)
    assert found.taken_as == {"time": "time", "angle": "angle", "u1": "front", "u2": "rear"}
    assert looks(found) == {
        "time": "clock, 0.02 a row",
        "angle": "angle, 4096 steps a turn",
        "u1": "2 levels",
        "u2": "constant",
    }
    assert found.suggestion.options == (
        "--columns angle=angle,front=u1,rear=u2,time=time --units angle=rad"
    )
    assert found.log is not None
    np.testing.assert_allclose(found.log.measured[:, 0], READ, atol=1e-6)


def test_without_names_the_looks_choose(tmp_path: Path) -> None:
    savemat(tmp_path / "run.mat", {"ans": np.vstack([TIME, VOLTS, READ])})
    found = described(tmp_path / "run.mat")
    assert found.suggestion.taken == {"angle": "3", "input": "2", "time": "1"}
    assert not found.problem


def test_a_log_of_two_angles_names_the_other(tmp_path: Path) -> None:
    path = csv(tmp_path / "log.csv", t=TIME, travel_deg=np.degrees(ANGLE), pitch_deg=ANGLE, u=VOLTS)
    found = described(path)
    assert found.suggestion.taken == {"angle": "pitch_deg", "input": "u", "time": "t"}
    assert found.suggestion.others == ("travel_deg",)


@pytest.mark.parametrize(
    ("values", "words", "unit"),
    [
        (np.mod(np.degrees(6.0 * ANGLE), 360.0), "angle, wraps 14 times", "deg"),
        (np.floor(ANGLE * 512 / math.tau) * 360.0 / 512, "angle, 512 steps a turn", "deg"),
        (np.round(1000.0 * ANGLE), "whole numbers", "counts"),
        (np.degrees(ANGLE), "signal", "deg"),
        (ANGLE, "signal", "rad"),
    ],
)
def test_the_unit_of_an_angle_is_guessed_from_its_values(
    tmp_path: Path, values: np.ndarray, words: str, unit: str
) -> None:
    found = described(csv(tmp_path / "log.csv", time=TIME, angle=values, u=VOLTS))
    assert looks(found)["angle"] == words
    assert found.suggestion.section.units == {"angle": unit}


def test_a_unit_that_is_given_is_not_guessed(plain: Path) -> None:
    assert described(plain, units={"angle": "deg"}).suggestion.section.units == {"angle": "deg"}


def test_a_clock_in_milliseconds(tmp_path: Path) -> None:
    found = described(csv(tmp_path / "log.csv", time=1000.0 * TIME, angle_rad=ANGLE, u=VOLTS))
    assert found.suggestion.section.units == {"time": "ms"}
    assert found.sampling is not None
    assert found.sampling.words.startswith("50 Hz, a row every 0.02 s (even), from 0 to 11.98 s")


def test_a_rate_is_no_output(tmp_path: Path) -> None:
    rate = np.gradient(ANGLE, TIME)
    found = described(csv(tmp_path / "log.csv", time=TIME, a=rate, b=ANGLE, c=VOLTS))
    assert looks(found)["a"] == "rate of b"
    assert found.suggestion.taken == {"angle": "b", "input": "c", "time": "time"}


def test_without_a_clock_the_period_is_asked_for(tmp_path: Path) -> None:
    path = csv(tmp_path / "log.csv", step=np.arange(ROWS), pitch_counts=np.round(1000 * ANGLE), u=VOLTS)
    result = command(path)
    assert result.exit_code == 1
    assert "--period SECONDS --out identified" in result.output
    assert "no column is a clock" in result.output
    assert command(path, "--period", "0.02").exit_code == 0


def repeated(times: np.ndarray) -> None:
    times[300] = times[299]


def jittered(times: np.ndarray) -> None:
    times[300] += 0.004


def gapped(times: np.ndarray) -> None:
    times[300:] += 1.0


@pytest.mark.parametrize(
    ("change", "said", "code"),
    [
        (repeated, "times that do not rise: 1 (line 302)", 1),
        (gapped, "gaps: 1 (line 302)", 1),
        (jittered, "(jitter up to 20 % of it)", 0),
    ],
)
def test_faults_of_the_clock_are_named_by_line(
    tmp_path: Path, change: Callable[[np.ndarray], None], said: str, code: int
) -> None:
    times = TIME.copy()
    change(times)
    result = command(csv(tmp_path / "log.csv", time=times, angle=ANGLE, u=VOLTS))
    assert said in result.output
    assert result.exit_code == code


def test_cells_that_are_no_numbers(tmp_path: Path) -> None:
    path = csv(tmp_path / "log.csv", time=TIME, angle=ANGLE, u=VOLTS)
    lines = path.read_text().splitlines()
    lines[100] = lines[100].replace(",", ",off", 1)
    path.write_text("\n".join(lines))
    result = command(path)
    assert result.exit_code == 1
    assert "1 empty cells" in result.output
    assert "line 101, column angle" in result.output


def test_spikes_are_named_and_the_option_that_removes_them(tmp_path: Path) -> None:
    angle = ANGLE.copy()
    angle[200] += 3.0
    result = command(csv(tmp_path / "log.csv", time=TIME, angle=angle, u=VOLTS))
    assert "angle: 1 spike(s), line 202; --remove-spikes removes them" in result.output


def test_written_options_are_found_again(plain: Path) -> None:
    result = command(plain, "--sign", "angle=-1", "--from", "1", "--write")
    assert result.exit_code == 0
    assert f"tenbaud identify {plain} --out identified\n" in result.output
    kept = tomllib.loads(Path(f"{plain}.toml").read_text())
    assert kept["signs"] == {"angle": -1}
    assert kept["start_s"] == 1.0
    again = described(plain)
    assert again.suggestion.section == described(plain, signs={"angle": -1}).suggestion.section
    assert again.log is not None
    assert again.log.start_s == 1.0


def test_options_that_cannot_be_used_are_named_and_not_written(plain: Path) -> None:
    result = command(plain, "--scale", "angle=nan", "--sign", "angle=2")
    assert result.exit_code != 0
    assert "flight_log.scales.angle = nan: Input should be a finite number" in str(result.exception)
    assert "flight_log.signs.angle = 2: Input should be -1 or 1" in str(result.exception)
    assert command(plain, "--from", "99", "--write").exit_code == 1
    assert not Path(f"{plain}.toml").exists()


def test_json_holds_what_the_text_says(plain: Path) -> None:
    told = json.loads(command(plain, "--json").output)
    assert told["rows"] == ROWS
    assert told["sampling"]["step_s"] == pytest.approx(0.02)
    assert told["columns"][1]["unit_guessed"] == "4096 steps are a turn"
    assert told["options"]["columns"]["angle"] == "angle"
    assert told["problem"] == ""


@pytest.mark.parametrize("ending", ["png", "svg"])
def test_the_figure_has_a_panel_per_column(plain: Path, tmp_path: Path, ending: str) -> None:
    figure = tmp_path / f"log.{ending}"
    assert command(plain, "--plot", figure).exit_code == 0
    content = figure.read_bytes()
    if ending == "svg":
        assert [content.count(f"<!-- {name}".encode()) for name in ("angle", "u1", "u2")] == [1, 1, 1]
    else:
        assert content.startswith(b"\x89PNG")


def test_what_is_no_log_is_an_error(tmp_path: Path) -> None:
    sheet = tmp_path / "log.xlsx"
    sheet.write_bytes(b"PK\x03\x04" + bytes(100))
    result = CliRunner().invoke(app, ["log", str(sheet)])
    assert result.exit_code != 0
    assert "Excel" in str(result.exception)
    assert "CSV" in str(result.exception)
