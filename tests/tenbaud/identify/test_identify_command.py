"""`tenbaud identify` as its user runs it: the rig, a run, a log, and logs that are no good."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from plant_sim.identification.errors import IdentificationError
from tenbaud.cli.commands import app
from tenbaud.config.load import load_config
from tests.plant_sim.identification.experiments import EXCITATION_A, experiment

TRUE = {"rate_damping_per_s": 0.1, "stiffness_per_s2": 0.5, "torque_gain_rad_per_v_s2": 0.35}


def run(*arguments: str) -> Result:
    return CliRunner().invoke(app, ["identify", *arguments])


def found(result: Result, index: int = 0) -> dict[str, float]:
    assert result.exit_code == 0, result.output
    estimates: dict[str, float] = json.loads(result.stdout)[index]["estimates"]
    return estimates


def test_when_the_simulated_rig_is_identified_then_both_ends_can_fly_with_the_result(
    tmp_path: Path,
) -> None:
    out = tmp_path / "out"
    result = run("--set", "transmitter.encoders.counts_per_turn=1024", "--json", "--out", str(out))
    for index in (0, 1):
        estimates = found(result, index)
        for name, true in TRUE.items():
            assert estimates[name] == pytest.approx(true, rel=0.03)
    config = load_config(None, out / "identified.toml")
    assert config.model.model_dump()["stiffness_per_s2"] == pytest.approx(0.5, rel=0.03)
    for name in ("figure-3.png", "figure-4.png", "figure-3.svg", "figure-4.svg", "identified-2.toml"):
        assert (out / name).stat().st_size > 100


def test_when_a_run_is_identified_then_its_own_plant_is_found(tmp_path: Path) -> None:
    flown = tmp_path / "flown"
    arguments = ["demo", "--link", "memory", "--mismatch", "0.1", "--json", "--out", str(flown)]
    assert CliRunner().invoke(app, arguments).exit_code == 0
    estimates = found(run(str(flown), "--json", "--out", str(tmp_path / "out")))
    for name, true in TRUE.items():
        assert estimates[name] == pytest.approx(1.1 * true, rel=0.03)


Cells = list[list[float]]


def write_log(path: Path, change: Callable[[Cells], None] = lambda rows: None) -> Path:
    record = experiment(EXCITATION_A, 30.0)
    rows: Cells = [
        [index * record.step_s, float(angle), float(front), float(rear)]
        for index, (angle, front, rear) in enumerate(
            zip(record.angle_rad, record.front_volts, record.rear_volts, strict=True)
        )
    ]
    change(rows)
    lines = [",".join(f"{value:.6f}" for value in row) for row in rows]
    path.write_text("\n".join(["t,pitch,uf,ur", *lines]) + "\n")
    return path


COLUMNS = ("--columns", "time=t,angle=pitch,front=uf,rear=ur")


def test_when_a_log_is_identified_then_time_unit_and_columns_are_as_given(tmp_path: Path) -> None:
    def degrees(rows: Cells) -> None:
        for row in rows:
            row[1] = math.degrees(row[1])

    log = write_log(tmp_path / "log.csv", degrees)
    out = str(tmp_path / "out")
    estimates = found(run(str(log), *COLUMNS, "--unit", "deg", "--json", "--out", out))
    for name, true in TRUE.items():
        assert estimates[name] == pytest.approx(true, rel=0.03)


def still(rows: Cells) -> None:
    for row in rows:
        row[2] = row[3] = 0.0


def in_degrees(rows: Cells) -> None:
    for row in rows:
        row[1] = math.degrees(row[1])


def in_millivolts(rows: Cells) -> None:
    for row in rows:
        row[2] *= 1000.0


def with_gap(rows: Cells) -> None:
    del rows[700:750]


def not_finite(rows: Cells) -> None:
    rows[10][1] = math.nan


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (still, "voltage difference of the motors never changes"),
        (in_degrees, "in degrees"),
        (in_millivolts, "millivolts"),
        (with_gap, "line 702, column t: 7.5 s after 6.99 s"),
        (not_finite, "line 12, column pitch"),
    ],
)
def test_when_a_log_is_no_good_then_the_error_names_the_cause(
    change: Callable[[Cells], None], text: str, tmp_path: Path
) -> None:
    log = write_log(tmp_path / "log.csv", change)
    result = run(str(log), *COLUMNS, "--unit", "rad", "--out", str(tmp_path / "out"))
    assert isinstance(result.exception, ValueError)
    assert text in str(result.exception)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (("--columns", "time=t,angle=yaw,front=uf,rear=ur"), "column yaw is missing"),
        (("--columns", "when=t"), "when is no signal of the model"),
        ((*COLUMNS, "--equilibrium", "later"), "--equilibrium later"),
        ((*COLUMNS, "--from", "29.9"), "too few"),
    ],
)
def test_when_an_option_is_no_good_then_the_error_names_it(
    arguments: tuple[str, ...], text: str, tmp_path: Path
) -> None:
    log = write_log(tmp_path / "log.csv")
    result = run(str(log), *arguments, "--unit", "rad", "--out", str(tmp_path / "out"))
    assert isinstance(result.exception, ValueError)
    assert text in str(result.exception)


def test_when_a_log_is_of_a_body_at_rest_then_a_warning_is_written_beside_the_estimate(
    tmp_path: Path,
) -> None:
    def quiet(rows: Cells) -> None:
        for index, row in enumerate(rows):
            row[1] = -0.115 + 0.001 * (index % 2)
            row[2], row[3] = 0.001 * (index % 3), 0.0

    log = write_log(tmp_path / "log.csv", quiet)
    out = tmp_path / "out"
    result = run(str(log), *COLUMNS, "--unit", "rad", "--json", "--out", str(out))
    assert result.exit_code == 0
    assert json.loads(result.stdout)[0]["warnings"]
    assert "# Warning" in (out / "identified.toml").read_text()


def test_when_the_excitation_is_not_understood_then_the_grammar_is_shown() -> None:
    result = run("--excitation", "triangle:1,2,3")
    assert isinstance(result.exception, IdentificationError)
    assert "square:FREQUENCY" in str(result.exception)
