"""Fitting: better on the flights that it saw, judged on those that it did not, the same every time."""

from __future__ import annotations

import csv
import json
import math
import random
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from tenbaud.cli.app import app
from tenbaud.config.load import load_config
from tenbaud.studies.settings import StudyError
from tenbaud.studies.study import Range
from tenbaud.studies.tuning import Split, Tuning, free_ranges, test_error, train_error, tune

SPLIT = Split((1, 2), (3, 4, 5), 0.5)
OVERRIDES = {"duration_s": 20.0, "transmitter": {"plant": {"mismatch": 0.1, "disturbance": "q=2e-3"}}}


def tuning_of(free: dict[str, Range], **changes: Any) -> Tuning:
    arguments: dict[str, Any] = {
        "preset": "paper-10baud",
        "file": None,
        "overrides": OVERRIDES,
        "free": free,
        "split": SPLIT,
        "evaluations": 60,
        "seed": 3,
    }
    return Tuning(**(arguments | changes))


def usual(**changes: Any) -> Tuning:
    return tuning_of(free_ranges(load_config("paper-10baud"), {}, model=False), **changes)


@pytest.mark.parametrize("method", ["differential-evolution", "nelder-mead"])
def test_when_constants_are_fitted_then_both_errors_are_those_of_the_flights(method: Any) -> None:
    tuning = usual(method=method)
    counts: list[int] = []
    tuned = tune(tuning, lambda count, error: counts.append(count))
    assert tuned.train_after < 0.8 * tuned.train_before
    assert tuned.train_after == train_error(tuning, tuned.values)
    assert tuned.test_after == test_error(tuning, tuned.values)
    assert tuned.test_after != tuned.train_after
    assert counts == list(range(1, tuned.evaluations + 1))
    assert tuned == tune(tuning, lambda count, error: None)


def test_when_no_constants_help_then_those_before_are_kept() -> None:
    useless = {"coder.initial_range_rad": Range.model_validate({"from": 40.0, "to": 50.0})}
    tuned = tune(tuning_of(useless, evaluations=8), lambda count, error: None)
    assert tuned.values == {"coder.initial_range_rad": 0.5}
    assert tuned.test_after == tuned.test_before


def test_when_the_model_is_asked_for_then_its_constants_are_fitted_too() -> None:
    free = free_ranges(load_config("paper-10baud"), {}, model=True)
    assert {"coder.decay", "coder.gains.1", "model.stiffness_per_s2", "model.equilibrium_rad"} <= {
        *free
    }


def test_when_a_constant_does_not_exist_then_the_nearest_is_named() -> None:
    one = Range.model_validate({"from": 0.1, "to": 1.0})
    with pytest.raises(StudyError, match=r"did you mean coder.decay\?"):
        free_ranges(load_config("paper-10baud"), {"coder.decoy": one}, model=False)
    with pytest.raises(StudyError, match="no usual constants"):
        free_ranges(load_config("usual-1000baud"), {}, model=False)


def test_when_a_recording_is_split_then_fit_and_judgement_see_different_halves(tmp_path: Path) -> None:
    log = tmp_path / "flight.csv"
    chance = random.Random(5)
    with log.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(("step", "pitch_counts", "right_volts", "left_volts"))
        for step in range(1000):
            wild = 500.0 if step >= 500 else 50.0
            writer.writerow((step, round(wild * math.sin(0.02 * step) + chance.gauss(0, 2)), 0.0, 0.0))
    found = tmp_path / "found.toml"
    command = [
        "tune",
        "--preset",
        "uiuc-10baud",
        "--rig",
        f"replay:{log}",
        "--out",
        str(found),
        "--json",
    ]
    command += ["--evaluations", "70", "--free", "coder.gains.1=0.5..20:log"]
    result = CliRunner().invoke(app, command)
    assert result.exit_code == 0, result.output
    summary = json.loads(result.stdout)
    assert summary["train_what"] == "first 50 % of the recording"
    assert summary["train_after"] <= summary["train_before"]
    assert summary["test_after"] > 2.0 * summary["train_after"], (
        "the second half moves ten times as far"
    )
    config = load_config(None, found)
    assert config.coder.model_dump()["gains"][1] == pytest.approx(summary["values"]["coder.gains.1"])
    assert "Judged on last 50 % of it" in found.read_text()
    again = CliRunner().invoke(app, command)
    assert again.exit_code != 0
    assert "exists already" in str(again.exception)
