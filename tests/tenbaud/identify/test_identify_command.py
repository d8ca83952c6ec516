"""`tenbaud identify` as its user runs it: the rig, a run, a log, and logs that are no good."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner, Result

import tenbaud
from plant_sim.identification.errors import IdentificationError
from tenbaud.build.flight_log import read_flight_log
from tenbaud.cli.commands import app
from tenbaud.config.load import load_config
from tenbaud.identification.api import Each
from tenbaud.identification.api import Result as Found
from tenbaud.log.table import LogError
from tenbaud.studies import quick
from tests.plant_sim.identification.experiments import EXCITATION_A, experiment
from tests.plant_sim.identification.test_linear import CASES, COUPLED, record_of
from tests.plant_sim.identification.test_pitch import random_volts, swing

TRUE = {"rate_damping_per_s": 0.1, "stiffness_per_s2": 0.5, "torque_gain_rad_per_v_s2": 0.35}


@pytest.fixture(autouse=True)
def _few_flights(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fit coder constants with few flights: `studies/test_quick.py` says how good they become."""
    monkeypatch.setattr(quick, "EVALUATIONS_MAX", 30)


def run(*arguments: str) -> Result:
    return CliRunner().invoke(app, ["identify", *arguments])


def found(result: Result, index: int = 0) -> dict[str, float]:
    assert result.exit_code == 0, result.output
    estimates: dict[str, float] = json.loads(result.stdout)[index]["estimates"]
    return estimates


@pytest.mark.parametrize(
    "rig",
    [
        ("transmitter.rig=serial", "transmitter.serial.port=/dev/none"),
        ("transmitter.rig=quarc",),
        ("transmitter.rig=hil",),
    ],
    ids=lambda rig: rig[0],
)
def test_a_real_rig_is_refused_before_it_is_opened(rig: tuple[str, ...], tmp_path: Path) -> None:
    options = [word for setting in rig for word in ("--set", setting)]
    result = run(*options, "--duration", "1", "--out", str(tmp_path / "out"))
    assert result.exit_code != 0
    assert "simulated rigs only" in str(result.exception)
    assert "tenbaud demo --clock real" in str(result.exception)
    assert not (tmp_path / "out").exists()


def test_when_the_simulated_rig_is_identified_then_both_ends_can_fly_with_the_result(
    tmp_path: Path,
) -> None:
    out = tmp_path / "out"
    counts = "transmitter.encoders.counts_per_turn=1024"
    result = run("--set", counts, "--json", "--no-fly", "--figure", "--out", str(out))
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
    arguments = ["demo", "--link", "memory", "--mismatch", "0.1", "--duration", "50", "--json"]
    assert CliRunner().invoke(app, [*arguments, "--out", str(flown)]).exit_code == 0
    out = tmp_path / "out"
    estimates = found(run(str(flown), "--json", "--no-fly", "--no-figure", "--out", str(out)))
    assert not list(out.glob("figure-*"))
    for name, true in TRUE.items():
        assert estimates[name] == pytest.approx(1.1 * true, rel=0.03)


Cells = list[list[float]]


def write_log(path: Path, change: Callable[[Cells], None] = lambda rows: None) -> Path:
    record = experiment(EXCITATION_A, 30.0)
    times = np.arange(len(record))[:, None] * record.step_s
    rows: Cells = np.hstack((times, record.outputs, record.inputs)).tolist()
    change(rows)
    lines = [",".join(f"{value:.6f}" for value in row) for row in rows]
    path.write_text("\n".join(["t,pitch,uf,ur", *lines]) + "\n")
    return path


COLUMNS = ("--columns", "time=t,angle=pitch,front=uf,rear=ur")


def in_degrees(rows: Cells) -> None:
    for row in rows:
        row[1] = math.degrees(row[1])


def test_when_a_log_is_identified_then_time_unit_and_columns_are_as_given(tmp_path: Path) -> None:
    log = write_log(tmp_path / "log.csv", in_degrees)
    out = tmp_path / "out"
    result = run(str(log), *COLUMNS, "--unit", "deg", "--json", "--no-fly", "--out", str(out))
    estimates = found(result)
    for name, true in TRUE.items():
        assert estimates[name] == pytest.approx(true, rel=0.03)
    said = json.loads(result.stdout)[0]
    assert said["structure"] == "pitch"
    assert said["motor_lag_s"] == pytest.approx(0.08, abs=0.02)


def still(rows: Cells) -> None:
    for row in rows:
        row[2] = row[3] = 0.0


def in_millivolts(rows: Cells) -> None:
    for row in rows:
        row[2] *= 1000.0


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (still, "voltage difference of the motors never changes"),
        (in_degrees, "360/1024: the column is in degrees and is read as rad, a factor of 57.3"),
        (in_millivolts, "in millivolts (a factor of 1000)"),
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
        (("--equilibrium", "later"), "--equilibrium later"),
        (("--lag", "much"), "--lag much"),
        (("--lag", "nan"), "--lag nan"),
        (("--equilibrium", "inf"), "--equilibrium inf"),
        (("--structure", "cubic"), "--structure cubic: give pitch"),
        (("--from", "29.9"), "too few"),
    ],
)
def test_when_an_option_is_no_good_then_the_error_names_it(
    arguments: tuple[str, ...], text: str, tmp_path: Path
) -> None:
    log = write_log(tmp_path / "log.csv")
    result = run(str(log), *COLUMNS, *arguments, "--unit", "rad", "--out", str(tmp_path / "out"))
    assert isinstance(result.exception, ValueError)
    assert text in str(result.exception)


def test_when_a_log_is_of_a_body_at_rest_then_no_model_is_written_and_the_experiment_is_named(
    tmp_path: Path,
) -> None:
    def quiet(rows: Cells) -> None:
        for index, row in enumerate(rows):
            row[1] = -0.115 + 0.001 * (index % 2)
            row[2], row[3] = 0.001 * (index % 3), 0.0

    log = write_log(tmp_path / "log.csv", quiet)
    out = tmp_path / "out"
    result = run(str(log), *COLUMNS, "--unit", "rad", "--out", str(out))
    assert result.exit_code == 1
    assert "not supported" in result.output
    assert "square wave" in result.output
    assert "fly with it" not in result.output
    assert not (out / "identified.toml").exists()


def write_columns(path: Path, names: str, *columns: np.ndarray) -> Path:
    lines = [",".join(f"{value:.6f}" for value in row) for row in np.hstack(columns).tolist()]
    path.write_text("\n".join([names, *lines]) + "\n")
    return path


def test_when_a_log_drifts_over_turns_then_it_is_identified_with_a_warning(tmp_path: Path) -> None:
    record = swing(0.02, random_volts(1000, 5.0, 60), 0.4, 4.0, 0.2)
    times = np.arange(len(record))[:, None] * record.step_s
    angles = record.outputs + 0.5 * times
    log = write_columns(tmp_path / "log.csv", "t,pitch,uf,ur", times, angles, record.inputs)
    out = tmp_path / "out"
    result = run(str(log), *COLUMNS, "--unit", "rad", "--json", "--no-fly", "--out", str(out))
    estimates = found(result)
    assert estimates["stiffness_per_s2"] == pytest.approx(4.0, rel=0.05)
    assert estimates["torque_gain_rad_per_v_s2"] == pytest.approx(0.2, rel=0.05)
    warnings = " ".join(json.loads(result.stdout)[0]["warnings"])
    assert "drifts by 0." in warnings


TEN_VOLTS = swing(0.02, random_volts(1500, 10.0, 60), 0.4, 4.0, 0.08)


def write_ten_volts(path: Path) -> Path:
    times = np.arange(len(TEN_VOLTS))[:, None] * TEN_VOLTS.step_s
    columns = times, TEN_VOLTS.outputs, TEN_VOLTS.inputs[:, :1]
    return write_columns(path, "time,theta,u", *columns)


def test_when_a_file_goes_beyond_the_limits_of_a_preset_then_its_own_are_written_and_demo_agrees(
    tmp_path: Path,
) -> None:
    log = write_ten_volts(tmp_path / "log.csv")
    out = tmp_path / "out"
    options = ("--columns", "angle=theta,front=u", "--unit", "rad", "--json", "--out", str(out))
    result = run(str(log), *options)
    assert found(result)["torque_gain_rad_per_v_s2"] == pytest.approx(0.08, rel=0.05)
    (flown,) = json.loads(result.stdout)[0]["flown"]["outputs"].values()
    written = str(out / "identified.toml")
    demo = ("demo", "--config", written, "--rig", f"replay:{log}", "--link", "memory", "--json")
    again = CliRunner().invoke(app, [*demo, "--out", str(tmp_path / "flight")])
    assert again.exit_code == 0, again.output
    said = json.loads(again.stdout)["outputs"]["pitch"]
    # The summary has fewer digits than the flight.
    assert said["error_live_rms"] == pytest.approx(flown["rms_error"], rel=1e-4)
    assert said["error_live_max"] == pytest.approx(flown["largest_error"], rel=1e-4)


def test_when_a_person_sets_what_the_preset_says_then_it_counts_as_set(tmp_path: Path) -> None:
    log = write_ten_volts(tmp_path / "log.csv")
    settings = {
        "flight_log.columns": {"angle": "theta", "front": "u"},
        "flight_log.units": {"angles": "rad"},
        "model.motor_lag_s": 0.08,
        "limits.command_max": 5.0,
    }
    result = tenbaud.identify(log, settings=settings)
    assert result.identified.found.lag_s == 0.08
    assert result.config.limits.command_max == 5.0


@pytest.mark.parametrize("header", ["", "time,speed (rad/s),u"])
def test_when_an_output_is_not_the_angle_of_the_model_then_the_structure_is_of_the_file(
    header: str, tmp_path: Path
) -> None:
    log = write_ten_volts(tmp_path / "log.csv")
    settings = {
        "flight_log.columns": {"out:theta": "theta", "in:u": "u"},
        "flight_log.units.angles": "rad",
    }
    if header:
        log.write_text(log.read_text().replace("time,theta,u", header))
        settings = {}
    result = tenbaud.identify(log, settings=settings)
    model = result.identified.found.structure
    assert model.kind == ("first-order" if header else "siso:2,0")
    assert result.model.get("outputs", ["speed"]) == ["speed" if header else "theta"]


def test_when_a_file_counts_its_rows_then_the_tick_of_no_preset_is_taken_for_its_period(
    tmp_path: Path,
) -> None:
    rows = np.arange(len(TEN_VOLTS))[:, None]
    log = write_columns(
        tmp_path / "log.csv", "step,pitch,front,rear", rows, TEN_VOLTS.outputs, TEN_VOLTS.inputs
    )
    with pytest.raises(LogError, match="--period SECONDS"):
        tenbaud.identify(log)
    assert tenbaud.identify(log, settings={"flight_log.period_s": 0.02}).config.timing.tick_s == 0.02


def test_when_rows_are_further_apart_than_ticks_then_the_estimates_come_without_a_flight() -> None:
    volts, level = random_volts(3000, 5.0, 40), [0.0]
    for push in volts[:-1]:
        level.append(level[-1] * math.exp(-0.02) + (1.0 - math.exp(-0.02)) * push)
    result = tenbaud.identify(
        {"level": level, "u": volts},
        outputs=["level"],
        inputs=["u"],
        tick_s=2.0,
        structure="first-order",
    )
    assert result.estimates["a"] == pytest.approx(0.01, rel=0.05)
    assert result.settings == {}
    assert "ticks are at most 1 s" in result.warnings[-1]


def test_when_a_set_point_is_logged_beside_a_command_then_it_is_left_out(tmp_path: Path) -> None:
    random = np.random.default_rng(2).normal(size=(len(TEN_VOLTS), 1))
    names = "time,theta,pitch_ref,i_ref,prefilter_out"
    times = np.arange(len(TEN_VOLTS))[:, None] * TEN_VOLTS.step_s
    columns = times, TEN_VOLTS.outputs, random, TEN_VOLTS.inputs[:, :1], random[::-1]
    log = write_columns(tmp_path / "log.csv", names, *columns)
    roles = {"out:theta": "theta"} | {f"in:{name}": name for name in names.split(",")[2:]}
    settings = {"flight_log.columns": roles, "flight_log.units.angles": "rad"}
    result = tenbaud.identify(log, settings=settings)
    assert result.identified.record.input_names == ("i_ref", "prefilter_out")
    assert any("pitch_ref: a set-point" in text for text in result.source.notes)
    assert "in:pitch_ref" not in result.settings["flight_log"]["columns"]


@pytest.mark.soak
def test_when_a_motor_is_identified_then_what_is_written_flies_its_record(tmp_path: Path) -> None:
    record = record_of(CASES[1], 1, 3000)
    times = np.arange(len(record))[:, None] * record.step_s
    names = "time,speed (rad/s),u (V)"
    log = write_columns(tmp_path / "motor.csv", names, times, record.outputs, record.inputs)
    out = tmp_path / "out"
    columns = "out:speed=2,in:u=3,time=1"
    result = run(str(log), "--columns", columns, "--json", "--out", str(out))
    estimates = found(result)
    assert [estimates["a"], estimates["b"]] == pytest.approx([2.0, 10.0], rel=0.05)
    said = json.loads(result.stdout)[0]
    assert said["structure"] == "first-order"
    assert said["flown"]["outcome"] == "ok"
    (flown,) = said["flown"]["outputs"].values()
    assert flown["largest_error"] < 0.2 * flown["largest"]
    config = load_config(None, out / "identified.toml")
    assert config.timing.tick_s == pytest.approx(0.01)
    assert config.limits.command_max == (3.0,)


def test_when_two_axes_are_identified_then_the_whole_coupled_model_is_written(tmp_path: Path) -> None:
    record = record_of(COUPLED, 2)
    times = np.arange(len(record))[:, None] * record.step_s
    log = write_columns(
        tmp_path / "axes.csv", "time,pitch,yaw,u1,u2", times, record.outputs, record.inputs
    )
    out = tmp_path / "out"
    columns = "out:pitch=pitch,out:yaw=yaw,in:u1=u1,in:u2=u2,time=time"
    result = run(
        *(str(log), "--columns", columns, "--unit", "rad", "--json", "--no-fly", "--figure"),
        *("--out", str(out)),
    )
    assert len(list(out.glob("figure-*"))) == 4
    estimates = found(result)
    assert estimates["pitch''/pitch"] == pytest.approx(-1.74, rel=0.05)
    assert estimates["yaw''/u2"] == pytest.approx(0.25, rel=0.05)
    model = load_config(None, out / "identified.toml").model.model_dump()
    assert np.array(model["A"])[1, :4] == pytest.approx([-1.74, -0.33, 0.3, 0.1], rel=0.05)
    assert model["F"]
    assert model["outputs"] == ("pitch", "yaw")


@pytest.mark.parametrize("named", ["", ",in:setpoint=setpoint"])
def test_when_no_command_was_logged_then_what_the_record_can_say_is_said(
    named: str, tmp_path: Path
) -> None:
    times = np.arange(6000)[:, None] * 0.01
    wanted = np.where(times % 12.0 < 6.0, 0.3, -0.3)
    state, rows = np.zeros(2), []
    for aim in wanted[:, 0]:
        rows.append(state[0])
        state = state + 0.01 * np.array([state[1], 4.0 * (aim - state[0]) - 2.4 * state[1]])
    log = write_columns(
        tmp_path / "loop.csv", "time,angle,setpoint", times, np.array(rows)[:, None], wanted
    )
    out = tmp_path / "out"
    columns = f"time=time,out:angle=angle{named}"
    result = run(str(log), "--columns", columns, "--unit", "rad", "--out", str(out))
    assert result.exit_code != 0
    text = str(result.exception)
    assert "log the voltages" in text
    if named:
        assert "own frequency 2" in text or "own frequency 1.9" in text
        assert "damping ratio 0.6" in text or "damping ratio 0.59" in text
    assert not out.exists()


def test_when_the_excitation_is_not_understood_then_the_grammar_is_shown() -> None:
    result = run("--excitation", "triangle:1,2,3")
    assert isinstance(result.exception, IdentificationError)
    assert "square:FREQUENCY" in str(result.exception)


def test_when_arrays_are_identified_then_the_model_is_that_of_the_command(tmp_path: Path) -> None:
    record = swing(0.02, random_volts(1500, 5.0, 60), 0.4, 4.0, 0.2)
    arrays = {"angle": record.outputs[:, 0], "u": record.inputs[:, 0]}
    result = tenbaud.identify(
        arrays, outputs=["angle"], inputs=["u"], tick_s=0.02, structure="pitch", units={"angle": "rad"}
    )
    assert result.refused == ()
    assert result.estimates["rate_damping_per_s"] == pytest.approx(0.4, rel=0.05)
    assert result.config.timing.tick_s == 0.02
    written = Each(result.identified, result.source, result.settings)
    Found([written], load_config(), False).save(tmp_path, fly=False, draw=False)
    log = read_flight_log(load_config(None, tmp_path / "identified.toml"))
    assert log.measured == pytest.approx(record.outputs, abs=1e-8)
    assert log.commands[:, 0] == pytest.approx(record.inputs[:, 0])
    with pytest.raises(IdentificationError, match="no array is called v"):
        tenbaud.identify(arrays, outputs=["angle"], inputs=["v"], tick_s=0.02)
