"""Studies as they are written: points, seeds, and what is refused."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest
import tomli_w

from tenbaud.studies.settings import StudyError
from tenbaud.studies.study import Study, read_study
from tenbaud.studies.study_file import StudyFile
from tests.rules.sources import TOP
from tests.tenbaud.studies.small import SMALL, study_of


def test_when_a_grid_is_given_then_every_combination_is_flown_with_every_seed() -> None:
    study = study_of()
    assert study.flights == 12
    flights = [study.flight(number) for number in range(study.flights)]
    assert len(set(flights)) == 12
    assert [study.points[point] for point, _ in flights[::3]] == [
        {"mismatch": mismatch, "rate": rate} for mismatch in (0.0, 0.1) for rate in (5, 10)
    ]
    assert [seed for _, seed in flights[:3]] == [1, 2, 3]


def test_when_the_rate_is_swept_then_period_and_channel_follow() -> None:
    periods = {config.timing.symbol_period_s: config.channel.rate_baud for config in study_of().configs}
    assert periods == {0.2: 5.0, 0.1: 10.0}


def test_when_short_names_are_swept_then_the_texts_are_put_together() -> None:
    study = study_of(grid={"loss": [0.1], "flip": [0.02], "delay": [0.05], "density": [1e-3]}, set={})
    (config,) = study.configs
    assert config.link.impairments == "loss=0.1,up:flip=0.02,delay=50.000000ms"
    assert config.transmitter.plant.disturbance == "q=0.001"


def test_when_words_have_many_symbols_then_the_rate_is_that_of_the_symbols() -> None:
    changes = {"coder": {"kind": "pcm", "bits": 4}}
    study = study_of(set=changes, grid={"rate": [10, 100]}, preset="usual-1000baud")
    settings = [(one.channel.rate_baud, one.timing.symbol_period_s) for one in study.configs]
    assert settings == [(10.0, 0.4), (100.0, 0.04)]


def test_when_the_configuration_has_texts_then_what_is_swept_is_added(tmp_path: Path) -> None:
    (tmp_path / "flight.toml").write_text(
        '[link]\nimpairments = "delay=30ms"\n[transmitter.plant]\ndisturbance = "step=0.5@1"\n'
    )
    values = SMALL | {"preset": None, "config": "flight.toml", "set": {}}
    values["grid"] = {"loss": [0.0, 0.1], "density": [1e-3]}
    study = Study(StudyFile.model_validate(values), tmp_path)
    assert [config.link.impairments for config in study.configs] == [
        "delay=30ms",
        "delay=30ms,loss=0.1",
    ]
    assert {config.transmitter.plant.disturbance for config in study.configs} == {"step=0.5@1,q=0.001"}


def test_when_one_entry_of_a_list_is_swept_then_the_others_stay() -> None:
    study = study_of(grid={"coder.gains.1": [1.5, 2.5], "coder.gains.0": [0.7]})
    assert [config.coder.gains for config in study.configs] == [(0.7, 1.5), (0.7, 2.5)]


@pytest.mark.parametrize("method", ["sobol", "random"])
def test_when_points_are_sampled_then_they_lie_within_and_come_again(method: str) -> None:
    ranges = {
        "coder.decay": {"from": 0.8, "to": 0.9},
        "coder.minimum_range_rad": {"from": 1e-3, "to": 1e-1, "scale": "log"},
    }
    sample = {"method": method, "points": 50, "seed": 4, "settings": ranges}
    points = study_of(grid={}, sample=sample).points
    assert points == study_of(grid={}, sample=sample).points
    assert points != study_of(grid={}, sample=sample | {"seed": 5}).points
    assert len(points) == 50
    assert all(0.8 <= point["coder.decay"] <= 0.9 for point in points)
    below = sum(point["coder.minimum_range_rad"] < 1e-2 for point in points)
    assert 15 < below < 35, "on a log scale half of the values are below the middle decade"


@pytest.mark.parametrize(
    "name", sorted(path.name for path in (TOP / "examples/studies").glob("*.toml"))
)
def test_when_an_example_is_read_then_it_is_a_study(name: str) -> None:
    assert read_study(TOP / "examples" / "studies" / name).flights >= 90


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"grid": {}}, "nothing is swept"),
        ({"grid": {"mismatch": []}}, "empty list"),
        ({"grid": {"coder.decy": [0.9]}}, "did you mean coder.decay"),
        ({"grid": {"mismatsch": [0.9]}}, "did you mean mismatch"),
        ({"grid": {"seed": [1, 2]}}, "use seeds"),
        ({"grid": {"rate": [10], "channel.rate_baud": [10.0]}}, "set the same thing"),
        ({"grid": {"rate": [7]}}, "whole number"),
        ({"grid": {"coder.decay": [1.5]}}, "coder.decay"),
        ({"grid": {"coder.bits": [3]}}, "coder.bits"),
        ({"grid": {"coder.gains.2": [3.0]}}, "has 2 entries"),
        ({"grid": {"coder.decay.0": [3.0]}}, "is no list"),
        ({"grid": {"channel.rate_baud": [5.0]}}, "lengthen symbol_period_s"),
        ({"grid": {"mismatch": [0.1, 0.1]}}, "names a value twice"),
        ({"grid": {"mismatch": {"from": 0.0, "to": 0.2}}}, "needs steps"),
        ({"grid": {"mismatch": {"from": 0.0, "to": 1.0, "steps": 3, "scale": "log"}}}, "above 0"),
        ({"grid": {"mismatch": {"from": 0.1, "to": 0.1, "steps": 3}}}, "one value only"),
        ({"seeds": 0}, "seeds"),
        ({"seeds": [1, 1]}, "none twice"),
        ({"seeds": 10_000_000}, "seeds"),
        ({"preset": "tunned-10baud"}, "tuned-10baud"),
        ({"flights": 3}, "unknown; a study has"),
        ({"sample": {"points": 4, "settings": {}}}, "sample.settings is empty"),
        (
            {"sample": {"points": 4, "settings": {"coder.decay": {"from": 0, "to": 1, "steps": 3}}}},
            "steps are of a grid",
        ),
        ({"set": {"seed": 4}}, "use seeds"),
        ({"set": {"transmitter": {"plant": {"mismatch": 0.1}}}}, "leave one of them out"),
        ({"set": {"channel": {"rate_baud": 10.0}}}, "leave one of them out"),
        ({"grid": {"duration_s": [1.0]}}, "leave one of them out"),
        ({"grid": {"density": [1e-3]}}, "has q=2e-3 already"),
        ({"grid": {"loss": [0.1]}, "set": {"link": {"impairments": "up:loss=0.2"}}}, "up:loss=0.2"),
        ({"grid": {"rate": [-5]}}, "rate = -5: give the number of symbols per second"),
        ({"grid": {"rate": [True]}}, "rate = True: give the number of symbols per second"),
        ({"grid": {"rate": [7]}}, "rate = 7 baud is no flight"),
        ({"grid": {"delay": [-0.1]}}, "delay = -0.1: give the delay of every message .* in seconds"),
        ({"grid": {"delay": ["x"]}}, "in seconds"),
        ({"grid": {"loss": [1.5]}}, "at least 0 and at most 1"),
        ({"grid": {"loss": [math.nan]}}, "grid.loss: a list of finite numbers"),
        ({"grid": {"loss": 0.1}}, "grid.loss: a list of finite numbers"),
        ({"grid": {"loss": {"from": 0.1}}}, "grid.loss.to: Field required"),
        ({"grid": {"coder": ["zoom"]}}, "no setting 'coder'"),
        (
            {"grid": {"transmitter.plant.disturbance": ["q=-1"]}, "set": {}},
            "disturbance = 'q=-1' is no",
        ),
        ({"grid": {"transmitter.rig": ["hil"]}}, "moves in real time"),
        ({"grid": {"transmitter.rig": ["replay"]}}, "names no recording"),
        ({"grid": {"receiver.reference.kind": ["csv"]}}, "names no file"),
        ({"grid": {"receiver.controller": ["nowhere:Law"]}}, "would import nowhere"),
        ({"grid": {"duration_s": [1e7]}, "set": {}}, "ticks"),
        (
            {"sample": {"points": 4, "settings": {"mismatch": {"from": 0.0, "to": 0.2}}}},
            "on the grid and sampled",
        ),
        (
            {
                "set": {"receiver": {"controller": "state_feedback"}},
                "grid": {"rate": [20], "model.kind": ["pitch", "pendulum"]},
            },
            "model.kind = 'pendulum' flies a plant with the outputs angle, rad, .* pitch, rad",
        ),
    ],
    ids=str,
)
def test_when_a_study_makes_no_sense_then_it_says_what_is_wrong(
    tmp_path: Path, changes: dict[str, Any], text: str
) -> None:
    path = tmp_path / "study.toml"
    path.write_text(tomli_w.dumps(SMALL | changes))
    with pytest.raises(StudyError, match=text) as caught:
        read_study(path)
    assert str(path) in str(caught.value)
