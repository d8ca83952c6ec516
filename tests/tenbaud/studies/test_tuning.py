"""Fitting: better on the flights that it saw, validated on others, the same every time."""

from __future__ import annotations

import csv
import json
import math
import random
import signal
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from channel.errors import TenbaudError
from channel.registry import Registry
from tenbaud.build.codec import build_codec
from tenbaud.build.flight_log import read_flight_log
from tenbaud.build.rig import nominal_plant
from tenbaud.cli.commands import app
from tenbaud.cli.tune import _need_chance
from tenbaud.config.load import load_config
from tenbaud.flight.outcome import ExitCode
from tenbaud.studies import judging
from tenbaud.studies.constants import free_ranges
from tenbaud.studies.flights import CompiledPoint
from tenbaud.studies.judging import PENALTY_RAD, Judge, Judged, Split, Tuning, is_worse, split_ticks
from tenbaud.studies.plain import fly_plain
from tenbaud.studies.records import Augment, phases_of, variants_of
from tenbaud.studies.settings import StudyError
from tenbaud.studies.study_file import Range
from tenbaud.studies.tuning import preset_text, report, shown, tune

REPLAY: dict[str, Any] = {
    "transmitter": {"rig": "replay"},
    "receiver": {"controller": "recorded"},
}
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


def judge(tuning: Tuning, values: dict[str, float], *, train: bool) -> Judged:
    return Judge(tuning)(values, train=train)


AS_RECORDED = Augment(scales=(1.0,), shoves=0.0, phases=1)


def usual(**changes: Any) -> Tuning:
    return tuning_of(free_ranges(load_config("paper-10baud"), {}, model=False), **changes)


def test_when_the_search_is_stopped_then_what_it_has_found_is_kept() -> None:
    seen: list[float] = []
    tuning = usual(evaluations=1000)
    tuned = tune(tuning, lambda count, error: seen.append(error), lambda: len(seen) >= 20)
    assert tuned.evaluations == len(seen) == 20
    assert tuned.train_after == seen[-1] < tuned.train_before
    assert tuned.test_after == judge(tuning, tuned.values, train=False).rms_rad


def test_when_ctrl_c_ends_the_command_then_the_preset_is_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(self: Judge, values: dict[str, float], *, train: bool) -> Judged:
        flown.append(1)
        if len(flown) == 20:
            signal.raise_signal(signal.SIGINT)
        return judge_as_before(self, values, train=train)

    flown: list[int] = []
    judge_as_before = Judge.__call__
    monkeypatch.setattr(Judge, "__call__", interrupted)
    out = tmp_path / "found.toml"
    fit = [*("tune", "--out", str(out), "--duration", "20", "--mismatch", "0.1"), "--seeds", "2"]
    fit += ["--disturbance", "q=2e-3"]
    done = CliRunner().invoke(app, fit)
    assert done.exit_code == ExitCode.INTERRUPTED, done.output
    # Twenty flights: those before the fit on both parts, and nineteen sets of constants.
    assert "stopped after 19 of 600 evaluations" in done.output
    assert f"{out}: fly it with --config" in done.output
    assert load_config(None, out).coder.kind == "zoom"


@pytest.mark.parametrize("method", ["cma-es", "nelder-mead"])
def test_when_constants_are_fitted_then_both_errors_are_those_of_the_flights(method: Any) -> None:
    tuning = usual(method=method)
    counts: list[int] = []
    tuned = tune(tuning, lambda count, error: counts.append(count))
    assert tuned.train_after < 0.8 * tuned.train_before
    assert tuned.train_after == judge(tuning, tuned.values, train=True).rms_rad
    assert tuned.test_after == judge(tuning, tuned.values, train=False).rms_rad
    assert tuned.test_after != tuned.train_after
    assert counts == list(range(1, 61))
    assert tuned.evaluations == 60
    assert tuned.without_figures == {}
    assert tuned == tune(tuning, lambda count, error: None)


def test_when_no_constants_help_then_those_before_are_kept() -> None:
    useless = {"coder.initial_range_rad": Range.model_validate({"from": 40.0, "to": 50.0})}
    tuned = tune(tuning_of(useless, evaluations=8), lambda count, error: None)
    assert tuned.values == {"coder.initial_range_rad": 0.5}
    assert tuned.test_after == tuned.test_before


@pytest.mark.parametrize("method", ["cma-es", "nelder-mead"])
@pytest.mark.parametrize("evaluations", [1, 2, 7, 33, 40])
def test_when_evaluations_are_bounded_then_no_more_are_flown(method: Any, evaluations: int) -> None:
    counts: list[int] = []
    tuning = usual(method=method, evaluations=evaluations, split=Split((1,), (2,), 0.5))
    tuned = tune(tuning, lambda count, error: counts.append(count))
    assert tuned.evaluations == len(counts) == evaluations


@pytest.mark.parametrize(
    ("preset", "overrides", "text"),
    [
        ("no-such-preset", {}, "there is no preset"),
        ("paper-10baud", {"transmitter": {"plant": {"disturbance": "q=-1"}}}, "disturbance"),
        ("paper-10baud", {"channel": {"rate_baud": 3.0}}, "symbol_period_s"),
        ("paper-10baud", {"transmitter": {"rig": "quarc"}}, "real time"),
        ("paper-10baud", {"coder": {"gains": [4000.0, 9e7]}}, "nothing to start from: "),
        ("uiuc-10baud", REPLAY | {"flight_log": {"file": "missing.csv"}}, "missing.csv"),
        ("uiuc-history-10baud", REPLAY | {"flight_log": {"file": "missing.csv"}}, "missing.csv"),
    ],
    ids=str,
)
def test_when_the_start_cannot_be_flown_then_the_error_says_why(
    preset: str, overrides: dict[str, Any], text: str
) -> None:
    free = {"coder.minimum_range_rad": Range.model_validate({"from": 0.01, "to": 0.1})}
    told: list[int] = []
    with pytest.raises(TenbaudError, match=text):
        tune(
            tuning_of(free, preset=preset, overrides=overrides),
            lambda count, error: told.append(count),
        )
    assert not told


def test_when_part_of_a_range_is_no_coder_then_it_is_penalised_and_counted() -> None:
    free = {"coder.decay": Range.model_validate({"from": 0.5, "to": 1.5})}
    tuned = tune(tuning_of(free, evaluations=20), lambda count, error: None)
    assert 3 < tuned.penalised < 17
    assert tuned.values["coder.decay"] <= 1.0
    assert tuned.train_after < 0.1 < PENALTY_RAD
    assert f"{tuned.penalised} of the 20 parameter sets" in preset_text(tuning_of(free), tuned)


def test_when_the_model_is_fitted_then_the_simulated_plant_stays() -> None:
    tuning = usual()
    before = tuning.config({})
    after = tuning.config({"model.stiffness_per_s2": 0.9, "model.motor_lag_s": 0.2})
    assert after.model.model_dump()["stiffness_per_s2"] == 0.9
    assert nominal_plant(after) == nominal_plant(before)
    assert CompiledPoint(after).constants[2] == CompiledPoint(before).constants[2]
    assert CompiledPoint(after).constants[0] != CompiledPoint(before).constants[0]
    plain = fly_plain(after.model_copy(update={"seed": 1}))
    assert plain._replace(engine="") == CompiledPoint(after).fly(1)[0]._replace(engine="")


@pytest.fixture(name="log")
def log_of(tmp_path: Path) -> Path:
    """A recording of 20 s whose second half moves ten times as far as its first."""
    log = tmp_path / "flight.csv"
    chance = random.Random(5)
    with log.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(("step", "pitch_counts", "right_volts", "left_volts"))
        for step in range(1000):
            wild = 500.0 if step >= 500 else 50.0
            writer.writerow((step, round(wild * math.sin(0.02 * step) + chance.gauss(0, 2)), 0.0, 0.0))
    return log


def replayed(log: Path, **changes: Any) -> dict[str, Any]:
    return REPLAY | {"flight_log": {"file": str(log)}} | changes


@pytest.mark.parametrize("duration_s", [8.0, 120.0])
def test_when_a_recording_is_judged_then_it_is_as_the_nodes_fly_it(
    log: Path, duration_s: float
) -> None:
    overrides = replayed(log, duration_s=duration_s)
    tuning = tuning_of({}, preset="uiuc-10baud", overrides=overrides, augment=AS_RECORDED)
    config = tuning.config({})
    border, ticks = split_ticks(config, 0.5)
    assert (border, ticks) == ((200, 400) if duration_s == 8.0 else (500, 1000))
    for train in (True, False):
        until = border if train else ticks
        changed = config.model_copy(update={"duration_s": until * 0.02})
        plain = fly_plain(changed, 0 if train else border)
        judged = judge(tuning, {}, train=train)
        # The first phase is that of the nodes; the others leave rows out.
        assert judged.each[0] == plain.first.error_live_rms
        assert len({*judged.each}) == judged.flights == (1 if train else 5)
    assert judged.rms_rad == pytest.approx(sum(judged.each) / 5, rel=1e-12)


def test_when_a_record_is_augmented_then_the_same_seed_gives_the_same_variants(log: Path) -> None:
    config = tuning_of({}, preset="uiuc-10baud", overrides=replayed(log)).config({})
    record, codec = read_flight_log(config), build_codec(config)
    augment = Augment(scales=(0.5, 1.0), shoves=0.8, seed=4)
    small, _, same, shoved = variants_of(config, codec, record, augment)
    again = variants_of(config, codec, record, augment)
    assert np.array_equal(again[3].log.measured, shoved.log.measured)
    other = variants_of(config, codec, record, replace(augment, seed=5))
    assert not np.array_equal(other[3].log.measured, shoved.log.measured)
    assert np.array_equal(same.log.measured, record.measured)
    middle = 0.5 * (record.measured + record.measured[0])  # half the motion, from where it starts
    assert np.allclose(small.log.measured, middle, atol=0.0008)
    assert np.array_equal(small.log.commands, 0.5 * record.commands)
    assert (small.size, same.size) == pytest.approx((0.5, 1.0), rel=1e-12)
    added = shoved.log.measured - record.measured
    assert added.std() == pytest.approx(0.8 * record.measured.std(), rel=0.01)
    assert phases_of(config, 3) == [0, 1, 3]
    assert phases_of(config, 50) == [0, 1, 2, 3, 4]


@pytest.mark.parametrize(
    ("before", "after", "worse"),
    [
        ((0.1, 0.2), (0.1, 0.2), False),
        ((0.1, 0.2), (0.10001, 0.20001), False),  # the same to the printed digits
        ((0.1, 0.2), (0.13, 0.19), False),  # within what phases differ by
        ((0.1, 0.2), (0.13, 0.24), True),
        ((0.1, 0.2), (0.05, 0.1), False),
        ((0.1,), (0.11,), True),
    ],
    ids=str,
)
def test_when_the_validation_is_no_worse_than_its_spread_then_nothing_is_over_fitted(
    before: tuple[float, ...], after: tuple[float, ...], worse: bool
) -> None:
    judged = [Judged(sum(each) / len(each), 0, len(each), "", each) for each in (before, after)]
    assert is_worse(*judged) is worse


def test_when_nothing_better_is_found_then_the_report_says_that_the_fit_failed() -> None:
    useless = {"coder.decay": Range.model_validate({"from": 1.1, "to": 1.2})}
    tuned = tune(tuning_of(useless, evaluations=6), lambda count, error: None)
    assert tuned.values == {"coder.decay": 0.95}
    lines = "\n".join(report(tuned))
    assert "the fit failed: none of the 5 parameter sets tried has figures" in lines
    assert "over-fitted" not in lines


def test_when_a_plant_has_several_outputs_then_the_weights_of_its_model_count() -> None:
    # A dry run is flown by the nodes, so that nothing needs to be compiled.
    changes = {"duration_s": 3.0, "transmitter": {"dry_run": True}, "model": {"weights": [4.0, 0.0]}}
    tuning = tuning_of({}, preset="aero-20baud", overrides=changes, split=Split((1,), (2,), 0.5))
    pitch, yaw = fly_plain(tuning.config({}).model_copy(update={"seed": 1})).outputs
    assert yaw.error_live_rms > 0.0
    assert judge(tuning, {}, train=True).rms_rad == pytest.approx(2.0 * pitch.error_live_rms, rel=1e-12)


def test_when_only_the_nodes_can_fly_a_recording_then_it_is_judged_too(log: Path) -> None:
    overrides = replayed(log, duration_s=6.0)
    overrides["transmitter"] = {"rig": "replay", "dry_run": True}
    tuning = tuning_of({}, preset="uiuc-10baud", overrides=overrides)
    first, second = judge(tuning, {}, train=True), judge(tuning, {}, train=False)
    assert 0.0 < first.rms_rad < 0.2
    assert first.lost == second.lost == 0
    assert first.flights == second.flights == 1
    assert first.rms_rad != second.rms_rad


def test_when_a_recording_is_too_short_to_split_then_it_is_refused(log: Path) -> None:
    tuning = tuning_of({}, preset="uiuc-10baud", overrides=replayed(log, duration_s=0.02))
    with pytest.raises(StudyError, match="too few to be split"):
        judge(tuning, {}, train=True)


def test_when_the_preset_cannot_be_written_then_nothing_is_flown(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    result = CliRunner().invoke(app, ["tune", "--out", str(tmp_path / "file" / "found.toml")])
    assert result.exit_code != 0
    assert "cannot be written: Not a directory" in str(result.exception)


@pytest.mark.parametrize(
    ("free", "text"),
    [
        (["coder.decay"], "write NAME=FROM..TO"),
        (["coder.decay=nan..1"], "finite"),
        (["coder.decay=a..1"], "both ends are numbers"),
        (["coder.decay=0..1:log"], "above 0"),
        (["coder.decay=0.1..0.5", "coder.decay=0.1..0.9"], "named twice"),
    ],
    ids=str,
)
def test_when_a_range_is_written_wrongly_then_it_says_how(
    tmp_path: Path, free: list[str], text: str
) -> None:
    command = ["tune", "--out", str(tmp_path / "found.toml")]
    for one in free:
        command += ["--free", one]
    result = CliRunner().invoke(app, command)
    assert result.exit_code == 2
    assert text in " ".join(result.output.replace("│", " ").split())


def test_when_a_recording_is_split_then_fit_and_judgement_see_different_halves(
    tmp_path: Path, log: Path
) -> None:
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
    assert summary["train_what"].startswith("0 ... 10 s of the recording at the sizes 0.6, 1, 2 with")
    assert summary["train_after"] <= summary["train_before"]
    assert summary["test_after"] > 2.0 * summary["train_after"], (
        "the second half moves ten times as far"
    )
    config = load_config(None, found)
    assert config.coder.model_dump()["gains"][1] == pytest.approx(summary["values"]["coder.gains.1"])
    assert "validated on 10 ... 20 s of it, mean of all sample phases" in found.read_text()
    assert f"flight_log.file='{log}'" in found.read_text()
    again = CliRunner().invoke(app, command)
    assert again.exit_code != 0
    assert "exists already" in str(again.exception)


def test_when_a_recording_is_long_then_it_is_fitted_where_it_moves_most_on_shared_arrays(
    log: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(judging, "FIT_TICKS", 200)
    overrides = replayed(log)
    tuning = tuning_of({}, preset="uiuc-10baud", overrides=overrides, augment=AS_RECORDED)
    fitted = Judge(tuning)
    first, last = fitted.fit
    assert (last - first, fitted.border, fitted.ticks) == (200, 500, 1000)
    assert first > 0
    assert fitted({}, train=True).lost == 0
    bench = fitted._test
    assert bench is not None
    one, other = (point.steady for point in bench._points[:2])
    for name in ("recorded", "commands", "applied"):
        assert np.shares_memory(one[name], other[name])


def test_when_errors_are_reported_then_their_unit_is_that_of_the_outputs() -> None:
    assert shown(0.5, ("rad",)) == "28.65 degrees"
    assert shown(0.5, ("rad/s",)) == "0.5 rad/s"
    assert shown(0.5, ("rad", "m")) == "0.5 rad and m"


@pytest.mark.parametrize(
    ("plant", "impairments", "refused"),
    [
        ({"disturbance": "q=0:2e-3", "kind": "furuta"}, "", False),
        ({"disturbance": "q=0:0", "kind": "furuta"}, "loss=1,down:burst=1/1", True),
        ({}, "delay=30ms,dead=40s,skew=3ppm", True),
        ({}, "down:loss=1%", False),
        ({}, "delay=30ms+-5ms", False),
        ({}, "burst=0.1/1", False),
        ({"kind": "my_package:Plant"}, "", False),
        ({"kind": "offered"}, "", False),
    ],
)
def test_simulated_flights_are_refused_where_every_seed_gives_the_same(
    plant: dict[str, Any], impairments: str, refused: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Registry, "_offered", lambda self: {"offered": []})
    given = {"transmitter": {"plant": plant}, "link": {"impairments": impairments}}
    config = load_config("paper-10baud", None, given, allow_code=True)
    with pytest.raises(StudyError, match="nothing is random") if refused else nullcontext():
        _need_chance(config)
