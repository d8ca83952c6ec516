"""The helicopter's missions, mass and cascade, what it refuses, and what it flies through."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tenbaud import Run, fly
from tenbaud.audit.audit import audit
from tenbaud.build.references import build_references
from tenbaud.build.rig import build_axes
from tenbaud.build.signals import configured_signals
from tenbaud.config.load import ConfigError, flattened, load_config
from tenbaud.replay.record import load_record
from tenbaud.replay.replay import replay
from tests.tenbaud.confirmed import PATIENT, check_flown, need_idle
from tests.tenbaud.emulated_flight import PATIENT as STALE
from tests.tenbaud.emulated_flight import RigProcess
from tests.tenbaud.processes import run as run_command
from tests.tenbaud.room import Rig, Room, agreement
from tests.tenbaud.test_emulated_flights import TCP, VECTORS

CASCADE: dict[str, Any] = {
    "controller": "pid",
    "pid": {
        "normal_force_volts": 5.364,
        "loops": [
            {
                "output": "elevation", "inputs": {"front": 0.5, "rear": 0.5},
                "proportional": 10.0, "integral": 2.0, "derivative": 5.0,
            },
            {
                "output": "travel", "steers": "pitch", "reversed": True, "set_point_max": 0.35,
                "proportional": 2.0, "derivative": 2.0,
            },
            {
                "output": "pitch", "inputs": {"front": 0.5, "rear": -0.5},
                "proportional": 20.0, "derivative": 6.0,
            },
        ],
    },
}  # fmt: skip
"""Elevation by both rotors, travel by the pitch, the pitch by their difference."""


def flown(folder: Path, seconds: float, **settings: Any) -> Run:
    given = {"duration_s": seconds, **dict(flattened(settings))}
    run = fly("helicopter-10baud", settings=given, out=folder / "run")
    check_flown(run.summary, run.summary["samples"])
    return run


def at(run: Run, signal: str, time_s: float) -> float:
    """Return a signal's mean over the second that begins then; a missed tick has no value."""
    times_s = np.asarray(run.time_s)
    second = (times_s >= time_s) & (times_s < time_s + 1.0)
    return float(np.nanmean(run.signals[signal].values[second]))


@pytest.mark.parametrize("seconds", [12.0, pytest.param(85.0, marks=pytest.mark.soak)])
def test_it_takes_off_from_its_rest_and_goes_where_the_mission_says(
    seconds: float, tmp_path: Path
) -> None:
    run = flown(tmp_path, seconds, mission="two-boxes")
    assert abs(at(run, "elevation", 2.0)) < 0.1
    assert at(run, "elevation", 10.0) == pytest.approx(0.1745, abs=0.1)
    for name, output in run.summary["outputs"].items():
        assert output["error_live_rms"] < 0.01, name
    if seconds > 80.0:
        assert at(run, "travel", 40.0) == pytest.approx(0.0, abs=0.15)
        assert at(run, "travel", 54.0) < -0.3
        assert abs(at(run, "elevation", 83.0)) < 0.05
        assert max(run.signals["front"].values[-100:]) < 1.5, "the rotors are nearly off"


def test_set_points_are_those_of_a_list_or_a_file(tmp_path: Path) -> None:
    file = tmp_path / "mission.csv"
    file.write_text("time_s,travel_rad,elevation_rad\n0,0,0.1\n0.5,0.2,0.15\n")
    csv = {"kind": "csv", "file": str(file), "offset": 0.0}
    points = {"kind": "points", "points": [[0.0, 0.1], [0.5, 0.15]], "offset": 0.0}
    for elevation in (csv, points):
        given = {"receiver": {"reference": {**csv, "elevation": elevation}}}
        config = load_config("helicopter-10baud", None, given)
        travel, elevated, pitch = build_references(config, configured_signals(config))
        assert travel is not None
        assert elevated is not None
        assert [(travel.value(k), elevated.value(k)) for k in (49, 50)] == [(0.0, 0.1), (0.2, 0.15)]
        assert pitch is None


def test_a_mission_is_one_of_the_package_and_gives_way_to_what_is_set() -> None:
    config = load_config("helicopter-10baud", None, {"mission": "square", "duration_s": 3.0})
    assert (config.mission, config.duration_s) == ("square", 3.0)
    assert config.receiver.reference.by_name["elevation"].kind == "constant"
    with pytest.raises(ConfigError, match=r"no mission 'squares'\. Did you mean square"):
        load_config("helicopter-10baud", None, {"mission": "squares"})


def test_a_mass_sent_along_the_arm_lowers_it(tmp_path: Path) -> None:
    level = {"kind": "constant", "amplitude": 0.17, "offset": 0.0}
    options = {"mass_moves": [[4.0, 0.1]], "mass_rad_per_s2_per_m": 4.0}
    run = flown(
        tmp_path,
        8.0,
        transmitter={"plant": {"options": options, "disturbance": "", "mismatch": 0.0}},
        receiver={"reference": {"kind": "constant", "amplitude": 0.0, "elevation": level}},
    )
    assert at(run, "elevation", 3.0) == pytest.approx(0.17, abs=0.03)
    assert at(run, "elevation", 7.0) < 0.13


def test_travel_is_steered_by_the_pitch_in_a_cascade_of_loops(tmp_path: Path) -> None:
    run = flown(tmp_path, 12.0, receiver=CASCADE)
    assert at(run, "travel", 11.0) == pytest.approx(0.4, abs=0.12)
    assert at(run, "elevation", 8.0) == pytest.approx(0.2745, abs=0.12)
    assert "reference_pitch" not in run.signals or np.isnan(run.signals["reference_pitch"].values).all()
    assert np.abs(run.signals["pitch"].values).max() < 0.45, "its set-point is bounded"


@pytest.mark.parametrize("steers", ["elevation", "travel", "yaw"])
def test_a_loop_steers_only_an_output_of_a_later_loop(steers: str, tmp_path: Path) -> None:
    elevation, travel, pitch = CASCADE["pid"]["loops"]
    loops = [elevation, {**travel, "steers": steers}, pitch]
    given = {"receiver": {"controller": "pid", "pid": {"loops": loops}}}
    with pytest.raises(ConfigError, match=rf"loops\.1: steers = '{steers}'.* further down.*: pitch"):
        fly("helicopter-10baud", settings=dict(flattened(given)), out=tmp_path / "run")


def test_the_unit_of_a_loop_that_steers_is_that_of_what_it_steers(tmp_path: Path) -> None:
    elevation, travel, pitch = CASCADE["pid"]["loops"]
    loops = [elevation, {**travel, "unit": "V/rad"}, pitch]
    given = {"receiver": {"controller": "pid", "pid": {"loops": loops}}}
    with pytest.raises(ConfigError, match=r"the output pitch that it steers is in rad, .* 'rad/rad'"):
        fly("helicopter-10baud", settings=dict(flattened(given)), out=tmp_path / "run")


@pytest.mark.parametrize(
    ("reference", "text"),
    [
        ({"elevation": {"amplitude": 0.4}}, r"elevation reaches 0\.5745 rad.* 0\.5236"),
        ({"amplitude": 4.0}, r"travel reaches -4 rad.* -3\.142 and 3\.142"),
        ({"kind": "points", "points": [[0.0, 0.0], [5.0, -3.5]]}, r"travel reaches -3\.5 rad"),
        ({"pitch": {"kind": "step", "amplitude": 0.6}}, r"pitch reaches 0\.6 rad.* 0\.5585"),
        ({"kind": "points", "points": []}, "the points of travel are missing"),
        ({"kind": "points", "points": [[1.0, 0.0], [1.0, 0.1]]}, r"points of travel: a time is 1\.0 s"),
    ],
)
def test_a_set_point_that_cannot_be_is_refused_with_its_output_and_numbers(
    reference: dict[str, Any], text: str
) -> None:
    config = load_config("helicopter-10baud", None, {"receiver": {"reference": reference}})
    with pytest.raises(ConfigError, match=text):
        build_references(config, configured_signals(config))


def test_a_rig_of_two_encoders_is_refused_with_the_axis_that_lacks_one() -> None:
    wired = {"bridge": {"axes": ["travel", "pitch"]}}
    config = load_config("helicopter-10baud", None, {"transmitter": wired})
    with pytest.raises(ConfigError, match=r"2 encoder\(s\), .* 3 output\(s\): elevation must be"):
        build_axes(config)


def test_lost_and_flipped_bits_and_a_corrupt_codec_are_survived(tmp_path: Path) -> None:
    done = run_command(
        *("demo", "--json", "--preset", "helicopter-10baud", "--link", "memory", "--duration", "8"),
        *("--impair", "up:loss=0.1,up:flip=0.02", "--sabotage", "sample=40,field=model.4"),
        *("--out", "run"),
        cwd=tmp_path,
    )
    assert done.code == 0, done.err
    summary = done.summary
    assert summary["desyncs"] == 1
    assert summary["rejoins"] >= 1
    assert summary["erasures"] > 3
    assert sum(one["symbols_share"] for one in summary["outputs"].values()) == pytest.approx(1.0)
    for name, output in summary["outputs"].items():
        assert output["error_live_rms"] < 0.1, name
    (corrupted,) = replay(load_record(tmp_path / "run")).differences
    assert re.match("transmitter: 1 state differs .* first at sample 40", corrupted)
    result = audit(tmp_path / "run")
    assert result.leaks
    assert all("sample 40" in one for one in result.leaks), "nothing else is wrong with the flight"


def test_it_flies_over_a_serial_line(tmp_path: Path) -> None:
    done = run_command(
        *("demo", "--json", "--preset", "helicopter-10baud", "--link", "serial", "--duration", "4"),
        *("--out", "run", *PATIENT),
        cwd=tmp_path,
    )
    assert done.code == 0, done.err
    check_flown(done.summary, 40)
    assert list(done.summary["outputs"]) == ["travel", "elevation", "pitch"]


def test_one_receiver_serves_it_beside_another_plant(tmp_path: Path) -> None:
    preset = {"three": "helicopter-10baud"}
    with Room(tmp_path, lambda name: agreement(preset.get(name))) as room:
        three = Rig(room, "three", preset="helicopter-10baud").greet()
        pitch = Rig(room, "pitch").greet()
        for _ in range(3):
            three.fly(2)
            pitch.fly(2)
        three.bye()
        pitch.bye()
        room.until_ended(2)
    for rig in (three, pitch):
        assert rig.session.counts["desyncs"] == 0
        assert room.summary(rig.name)["samples"] == 6
    assert 'kind = "helicopter"' in (tmp_path / "three" / "config.toml").read_text()


@pytest.mark.real_time
@pytest.mark.parametrize("form", [pytest.param("cobs", marks=pytest.mark.soak), "quarc"])
def test_an_emulated_rig_turns_three_encoders(form: str, tmp_path: Path) -> None:
    mission = ("--preset", "helicopter-10baud", "--set", "mission=two-boxes")
    vectors = VECTORS if form == "quarc" else ()
    rig = RigProcess(form, "--watchdog", "1", *mission, *(TCP if vectors else ()), *vectors)
    try:
        address = ("--rig", f"{form}:{rig.address}", "--clock", "real", *STALE)
        command = ("demo", "--json", *mission, *vectors, *address, "--duration", "6", "--out", "run")
        done = run_command(*command, cwd=tmp_path)
    finally:
        device = rig.end()
    assert done.code == 0, done.err
    check_flown(done.summary, 60)
    assert (device["volts"], device["enabled"]) == ([0.0, 0.0], False)
    assert at(Run(tmp_path / "run"), "measured_elevation", 5.0) > 0.15, "it has taken off"
    need_idle(done.summary)
    for name, output in done.summary["outputs"].items():
        assert output["error_live_rms"] < 0.02, name
