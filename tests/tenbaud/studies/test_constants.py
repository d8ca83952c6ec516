"""Which constants may be fitted, within which ranges, and the configuration with others."""

from __future__ import annotations

import pytest

from tenbaud.build.codec import build_codec
from tenbaud.config.load import load_config
from tenbaud.studies.constants import changed, free_ranges, present
from tenbaud.studies.settings import StudyError
from tenbaud.studies.study_file import Range


def test_when_the_model_is_asked_for_then_its_constants_are_fitted_too() -> None:
    free = free_ranges(load_config("paper-10baud"), {}, model=True)
    assert "model.growth_per_s" in free_ranges(load_config("pendulum-30baud"), {}, model=True)
    assert {"coder.decay", "coder.gains.1", "model.stiffness_per_s2", "model.equilibrium_rad"} <= {
        *free
    }


def test_when_a_constant_does_not_exist_then_the_nearest_is_named() -> None:
    one = Range.model_validate({"from": 0.1, "to": 1.0})
    with pytest.raises(StudyError, match=r"did you mean coder.decay\?"):
        free_ranges(load_config("paper-10baud"), {"coder.decoy": one}, model=False)
    with pytest.raises(StudyError, match="no usual constants"):
        free_ranges(load_config("usual-1000baud"), {}, model=False)


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("transmitter.plant.mismatch", "no constant of coder or model"),
        ("rate", "no constant of coder or model"),
        ("coder.window_signs", "whole number"),
        ("coder.correction", "not a number"),
        ("coder.gains.2", "not a constant"),
        ("coder.weights.0", "not a constant"),
    ],
)
def test_when_something_else_is_to_be_fitted_then_it_is_refused(name: str, text: str) -> None:
    one = Range.model_validate({"from": 0.1, "to": 1.0})
    with pytest.raises(StudyError, match=text):
        free_ranges(load_config("paper-10baud"), {name: one}, model=False)


def test_when_a_usual_constant_is_zero_then_it_stays_zero() -> None:
    config = load_config("paper-10baud", None, {"model": {"motor_lag_s": 0.0}})
    assert "model.motor_lag_s" not in free_ranges(config, {}, model=True)


def test_when_a_usual_constant_is_negative_then_its_sign_stays() -> None:
    config = load_config("paper-10baud", None, {"model": {"torque_gain_rad_per_v_s2": -0.4}})
    one = free_ranges(config, {}, model=True)["model.torque_gain_rad_per_v_s2"]
    assert (one.first, one.last, one.scale) == (-0.2, -0.8, "linear")


def test_when_a_part_comes_from_outside_then_its_options_are_fitted() -> None:
    coder = {"kind": "tests.outside:Coder", "options": {"gain": 0.5, "table": [1.0, 2.0]}}
    config = load_config("paper-10baud", None, {"coder": coder})
    one = Range.model_validate({"from": 0.1, "to": 3.0})
    names = {"coder.options.gain": one, "coder.options.table.1": one}
    assert free_ranges(config, names, model=False) == names
    assert present(config, "coder.options.table.1") == 2.0
    found = changed(config, {"coder.options.gain": 0.7, "coder.options.table.1": 2.5})
    assert found.coder.model_dump()["options"] == {"gain": 0.7, "table": [1.0, 2.5]}
    with pytest.raises(StudyError, match="not a constant"):
        free_ranges(config, {"coder.options.size": one}, model=False)


def test_when_a_matrix_is_fitted_then_the_ticks_of_the_model_follow() -> None:
    config = load_config("servo-10baud")
    assert config.model.kind == "linear"
    found = changed(config, {"model.A.1.1": -7.5}).model.model_dump()
    assert found["A"][1][1] == -7.5
    assert found["F"] != config.model.model_dump()["F"]
    build_codec(config.model_copy(update={"model": changed(config, {"model.A.1.1": -7.5}).model}))
