"""An unstable plant of one angle and one motor flies by its preset alone, as any other does."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from tenbaud import FlightResult, MemoryFlight, Run, load_preset
from tenbaud.audit.audit import audit
from tenbaud.config.load import ConfigError
from tenbaud.replay.record import load_record
from tenbaud.replay.replay import replay
from tests.tenbaud.confirmed import need_idle
from tests.tenbaud.processes import run as run_command

PRESET = "pendulum-30baud"
FALLEN_RAD = 0.3


def flown(seconds: float, **settings: object) -> FlightResult:
    parts = load_preset(PRESET, {name.replace("__", "."): value for name, value in settings.items()})
    flight = MemoryFlight(parts.codec, parts.terms, parts.plant, parts.controller)
    return flight.fly(seconds)


@pytest.mark.parametrize("clock", ["virtual", pytest.param("real", marks=pytest.mark.real_time)])
def test_it_stands_as_two_processes_on_either_clock(tmp_path: Path, clock: str) -> None:
    folder = tmp_path / "run"
    done = run_command(
        *("demo", "--preset", PRESET, "--clock", clock, "--duration", "2", "--out", str(folder)),
        cwd=tmp_path,
    )
    assert done.code == 0, done.err
    summary = json.loads((folder / "summary.json").read_text())
    assert summary["desyncs"] == 0
    (name,) = summary["outputs"]
    assert name == "angle"
    record = load_record(folder)
    assert replay(record).equal
    result = audit(folder)
    assert result.passed, result.leaks + result.gaps
    assert Run(folder).config.model.kind == "pendulum"
    if clock == "real":
        need_idle(summary)
    assert summary["outputs"]["angle"]["largest"] < FALLEN_RAD


@pytest.mark.parametrize("mismatch", [0.1, -0.1])
def test_a_plant_off_the_model_and_pushed_about_stands_with_the_lead_of_a_real_clock(
    mismatch: float,
) -> None:
    settings = {"transmitter__plant__disturbance": "q=1e-2", "timing__lead_ticks": 15}
    result = flown(20.0, transmitter__plant__mismatch=mismatch, **settings)
    assert np.abs(result.angles_rad).max() < FALLEN_RAD
    assert result.commands.shape == (5000, 1), "one motor is one motor"


def test_with_fewer_bits_than_its_errors_grow_by_it_is_refused_with_both_rates() -> None:
    with pytest.raises(ConfigError, match=r"7\.143 bit/s are too few.* more than 10\.49 bit/s"):
        flown(10.0, timing__symbol_period_s=0.14)


@pytest.mark.soak
@pytest.mark.parametrize("seed", range(3))
def test_it_stands_for_ten_minutes(seed: int) -> None:
    settings = {"transmitter__plant__disturbance": "q=1e-2", "timing__lead_ticks": 15, "seed": seed}
    result = flown(600.0, transmitter__plant__mismatch=0.05, **settings)
    assert np.abs(result.angles_rad).max() < FALLEN_RAD
