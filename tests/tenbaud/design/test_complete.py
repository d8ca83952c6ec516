"""Configurations of linear plants: completed once, refused when they are not, or not any more."""

from __future__ import annotations

import copy
import json
import re
import tomllib
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from channel.codec.models.linear import LinearModel
from channel.codec.signals import signals_of
from channel.line.line import bit_rate
from tenbaud.build.codec import build_codec, configured_rate
from tenbaud.build.flight import agree
from tenbaud.cli.commands import app
from tenbaud.config.load import (
    ConfigError,
    dump_config,
    load_config,
    merged_values,
    preset_names,
)
from tenbaud.design.complete import completed

PENDULUM: dict[str, Any] = {
    "kind": "linear",
    "A": [[0.0, 1.0], [53.6, 0.0]],
    "B": [[0.0], [1.0]],
    "C": [[1.0, 0.0]],
    "densities": [2e-3],
    "states": ["angle", "rate"],
    "state_units": ["rad", "rad/s"],
}
LONG_DESIGNS = (
    *("pendulum-13baud", "pendulum-16baud"),
    "servo-10baud",
    "aero-20baud",
    "furuta-50baud",
    "heading-1baud",
    "helicopter-10baud",
)
AT_20 = {"timing": {"symbol_period_s": 0.05}, "channel": {"rate_baud": 20.0}}
FILE = """
model = {kind = "linear", A = [[0, 1], [53.6, 0]], B = [[0], [1]], C = [[1, 0]], densities = [2e-3]}
coder = {kind = "direction"}
timing = {symbol_period_s = 0.05}
channel = {rate_baud = 20.0}
"""


@cache
def _designed_pendulum() -> dict[str, Any]:
    return completed({**AT_20, "model": PENDULUM, "coder": {"kind": "direction"}})


def designed_pendulum() -> dict[str, Any]:
    """Return the pendulum at 20 bit/s, designed once for all tests."""
    return copy.deepcopy(_designed_pendulum())


def test_when_a_configuration_is_completed_then_both_ends_read_the_same_bits() -> None:
    values = designed_pendulum()
    config = load_config("paper-10baud", None, values)
    codec = build_codec(config)
    assert isinstance(codec.model, LinearModel)
    assert codec.model.constants.transition == pytest.approx(
        (1.0027, 0.010009, 0.53648, 1.0027), rel=1e-4
    )
    assert [one.label for one in signals_of(codec.model).states] == ["angle, rad", "rate, rad/s"]
    assert signals_of(codec.model).output_states == (0,)
    again = load_config("paper-10baud", None, json.loads(config.model_dump_json()))
    other = build_codec(again)
    assert other.model.constants == codec.model.constants  # type: ignore[attr-defined]
    assert other.coder.constants == codec.coder.constants  # type: ignore[attr-defined]
    assert again.shared_json(5) == config.shared_json(5)
    assert "direction" in dump_config(config)


def test_when_the_bits_are_too_few_for_a_plant_then_the_error_has_both_numbers() -> None:
    growing = {"kind": "pitch", "stiffness_per_s2": -53.6, "rate_damping_per_s": 0.0}
    for model, state in ((PENDULUM, "rate"), (growing, "pitch_rate")):
        values = completed({"model": model})
        config = load_config("paper-10baud", None, values)
        text = rf"10 bit/s are too few.*, {state} fastest by 7\.32.*more than 10\.56 bit/s; shorten"
        with pytest.raises(ConfigError, match=text):
            agree(config, "virtual")


def test_when_the_plant_was_changed_after_its_design_then_it_is_refused() -> None:
    values = completed({**AT_20, "model": PENDULUM})
    changed = {**values["model"], "A": [[0.0, 1.0], [50.0, 0.0]]}
    for model, timing in ((changed, {}), (values["model"], {"tick_s": 0.005})):
        config = load_config(
            "paper-10baud", None, {**values, "model": model, "timing": {**AT_20["timing"], **timing}}
        )
        with pytest.raises(ConfigError, match=r"model\.F is not that of A and B.*tenbaud design"):
            agree(config, "virtual")


def test_when_a_linear_model_was_never_designed_then_it_says_how() -> None:
    config = load_config("paper-10baud", None, {**AT_20, "model": PENDULUM})
    with pytest.raises(ConfigError, match="`tenbaud design` finds them"):
        agree(config, "virtual")


def test_when_the_plant_is_discrete_then_its_continuous_one_is_found() -> None:
    values = designed_pendulum()
    discrete = {name: value for name, value in values["model"].items() if name not in "AB"}
    again = completed({**values, "model": discrete})
    for name in ("transition", "worth", "start"):
        for row, other in zip(again["coder"][name], values["coder"][name], strict=True):
            assert row == pytest.approx(other, rel=1e-5)


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"A": [[0.0, 1.0]]}, "A must have 2 rows of 2 numbers"),
        ({"B": [[0.0], [1.0, 2.0]]}, "B must have 2 rows of 1 numbers"),
        ({"densities": [1.0, 2.0]}, "densities has 2 entries, and 1 are needed"),
        ({"weights": [1.0, 2.0]}, "weights has 2 entries"),
        ({"states": ["angle"]}, "states has 1 entries, and 2 are needed"),
        ({"states": ["angle", "angle"]}, "states: angle is named twice"),
        ({"states": ["angle", "Rate!"]}, "'Rate!' is no name of a signal"),
        ({"corrected": 3}, "corrected is 3, and there are 2 states"),
        ({"C": [[1.0, 0.0], [1.0]]}, "C must have 2 rows of 2 numbers"),
    ],
)
def test_when_a_section_does_not_fit_then_the_error_names_the_field(
    changes: dict[str, Any], text: str
) -> None:
    with pytest.raises(ConfigError, match=text.replace("!", r"\!")):
        load_config("paper-10baud", None, {"model": {**PENDULUM, **changes}})


def test_when_nothing_can_be_designed_then_the_error_says_why() -> None:
    for model, text in (
        ({**PENDULUM, "C": [[0.0, 0.0]]}, "not observable"),
        ({**PENDULUM, "G": [[0.0], [0.0]]}, "does not reach every state"),
        ({"kind": "hold"}, "describes no plant to design for"),
    ):
        with pytest.raises(ConfigError, match=text):
            completed({**AT_20, "model": model, "coder": {"kind": "direction"}})


TWO_ROOTS = {
    "kind": "linear",
    "A": [[2.0, 0.0], [0.0, -1.0]],
    "B": [[1.0], [1.0]],
    "C": [[1.0, 0.0], [0.0, 1.0]],
    "outputs": ["growing", "steady"],
}


def test_when_the_weights_hide_a_growing_motion_then_design_and_flight_name_who_shows_it() -> None:
    hidden = {**TWO_ROOTS, "weights": [0.0, 1.0]}
    text = r"eigenvalue 2 1/s.* grows by itself.*give growing, which shows it, a weight above 0"
    with pytest.raises(ConfigError, match=text):
        completed({**AT_20, "model": hidden, "coder": {"kind": "direction"}})
    whole = completed({**AT_20, "model": TWO_ROOTS, "coder": {"kind": "direction"}})
    whole["model"]["weights"] = [0.0, 1.0]
    with pytest.raises(ConfigError, match=text):
        agree(load_config("paper-10baud", None, whole), "virtual")
    blind = {**TWO_ROOTS, "C": [[0.0, 1.0]], "outputs": ["steady"]}
    with pytest.raises(ConfigError, match=r"eigenvalue 2 1/s.*add an output that shows it to C"):
        completed({**AT_20, "model": blind, "coder": {"kind": "direction"}})


def test_when_a_plant_grows_then_its_coder_is_designed_for_what_its_encoders_show() -> None:
    values = {**AT_20, "model": PENDULUM, "coder": {"kind": "direction"}}
    exactly = {"transmitter": {"encoders": {"quantised": False}}}
    exact, coarse = completed({**values, **exactly}), designed_pendulum()
    assert coarse["coder"]["noise"][0][0] > 2.0 * exact["coder"]["noise"][0][0]
    own = completed({**values, "transmitter": {"encoders": {"angle": {"counts_per_turn": 4096}}}})
    assert own["coder"] == coarse["coder"], "4096 counts are the default"
    steady = {**values, "model": {**PENDULUM, "A": [[0.0, 1.0], [-4.0, 0.0]]}}
    assert completed({**steady, **exactly})["coder"] == completed(steady)["coder"]


def test_when_a_file_builds_on_a_preset_then_its_coder_is_designed_for_the_preset_s_encoders(
    tmp_path: Path,
) -> None:
    own, made = tmp_path / "own.toml", tmp_path / "made.toml"
    own.write_text('preset = "furuta-50baud"\n')
    done = CliRunner().invoke(app, ["design", "--config", str(own), "--out", str(made)])
    assert done.exit_code == 0, done.output
    usual = np.array(merged_values("furuta-50baud")["coder"]["noise"])
    found = np.array(tomllib.loads(made.read_text())["coder"]["noise"])
    assert np.abs(found - usual).max() < 1e-6 * np.abs(usual).max()


@pytest.mark.parametrize("preset", ["pendulum-13baud", "pendulum-16baud", "pendulum-20baud"])
def test_when_a_preset_is_slowed_below_its_smallest_rate_then_every_way_to_fly_it_is_refused(
    preset: str, tmp_path: Path
) -> None:
    slow = ["--set", "timing.tick_s=0.005", "--set", "timing.symbol_period_s=0.1"]
    file = tmp_path / "study.toml"
    file.write_text(
        f'preset = "{preset}"\nset = {{timing.tick_s = 0.005}}\n'
        'grid = {"timing.symbol_period_s" = [0.1]}\n'
    )
    for arguments in (
        ["demo", "--preset", preset, *slow],
        ["transmit", "--preset", preset, *slow],
        ["receive", "--preset", preset, *slow],
        ["sweep", str(file), "--out", str(tmp_path / "swept")],
    ):
        done = CliRunner().invoke(app, arguments)
        assert done.exit_code != 0
        assert re.search("10 bit/s are too few.*more than 10.49 bit/s", str(done.exception)), arguments


def test_when_a_coder_is_of_another_plant_then_it_is_refused() -> None:
    values = designed_pendulum()
    three = {"kind": "linear", "F": [[1.0, 0, 0], [0, 1.0, 0], [0, 0, 1.0]], "C": [[1.0, 0, 0]]}
    config = load_config("paper-10baud", None, {**values, "model": {**three, "E": [[1.0]] * 3}})
    with pytest.raises(ConfigError, match="corrects 2 states and the model takes corrections of 3"):
        agree(config, "virtual")


def test_when_the_command_completes_a_file_then_it_flies(tmp_path: Path) -> None:
    source, made = tmp_path / "plant.toml", tmp_path / "flight.toml"
    source.write_text(FILE)
    done = CliRunner().invoke(app, ["design", "--config", str(source), "--out", str(made)])
    assert done.exit_code == 0, done.output
    codec = build_codec(load_config(None, made))
    assert codec.coder.alphabet.symbols_per_word == 1
    for file in (source, made):
        shown = CliRunner().invoke(app, ["floor", "--config", str(file)])
        assert "10.56 bit/s, by the data-rate theorem" in shown.output
        assert "20 bit/s" in shown.output


def test_when_the_downlink_is_narrow_then_the_law_of_both_ends_is_in_the_completed_file(
    tmp_path: Path,
) -> None:
    source, made = tmp_path / "plant.toml", tmp_path / "flight.toml"
    source.write_text(FILE + 'receiver = {controller = "state_feedback", reference.amplitude = 0.2}')
    words = ["design", "--config", str(source), "--out", str(made)]
    for settings, narrow in ((), False), (("--set", "channel.downlink=narrow"), True):
        done = CliRunner().invoke(app, [*words, *settings])
        assert done.exit_code == 0, done.output
        assert ("law" in tomllib.loads(made.read_text()).get("downlink", {})) is narrow
    written = tomllib.loads(made.read_text())["downlink"]["law"]
    shared = json.loads(agree(load_config(None, made), "virtual").identity.config)
    assert shared["downlink"]["law"] == written


def test_when_a_configuration_is_too_slow_for_its_plant_then_its_floor_says_what_is_needed(
    tmp_path: Path,
) -> None:
    low = tmp_path / "low.toml"
    low.write_text(FILE.replace("0.05", "0.1").replace("20.0", "10.0"))
    shown = CliRunner().invoke(app, ["floor", "--config", str(low)])
    assert (shown.exit_code, "none: at this rate it grows" in shown.output) == (1, True)
    found = CliRunner().invoke(app, ["floor", "--config", str(low), "--json"])
    assert (found.exit_code, json.loads(found.output)["rms"]) == (1, None)
    enough = CliRunner().invoke(app, ["floor", "--config", str(low), "--rate", "20"])
    assert (enough.exit_code, "least rms output_1" in enough.output) == (0, True)
    low.write_text(FILE.replace("2e-3", "0"))
    still = CliRunner().invoke(app, ["floor", "--config", str(low)])
    assert (still.exit_code, "no disturbance reaches the plant" in still.output) == (2, True)


def test_when_a_floor_is_asked_for_then_every_output_has_its_own() -> None:
    shown = CliRunner().invoke(app, ["floor", "--plant", "helicopter", "--rate", "20"])
    assert shown.exit_code == 0, shown.output
    for axis, degrees in (("travel", "0.133"), ("elevation", "0.135"), ("pitch", "0.134")):
        assert any(
            f"least rms {axis}" in line and degrees in line for line in shown.output.splitlines()
        )
    found = CliRunner().invoke(app, ["floor", "--plant", "pendulum", "--rate", "10", "--json"])
    assert found.exit_code == 1
    figures = json.loads(found.output)
    assert figures["rate_needed_bit_s"] == pytest.approx(10.562, abs=1e-3)
    assert figures["rms"] is None


@pytest.mark.parametrize(
    ("preset", "output"), [("paper-10baud", "pitch"), ("pendulum-30baud", "angle")]
)
def test_when_a_preset_is_asked_about_then_its_output_has_the_name_of_its_model(
    preset: str, output: str
) -> None:
    shown = CliRunner().invoke(app, ["floor", "--preset", preset])
    assert f"least rms {output} " in shown.output


def test_when_a_preset_is_asked_about_then_its_rate_and_words_count() -> None:
    shown = CliRunner().invoke(app, ["floor", "--preset", "paper-20baud"])
    assert "20 bit/s" in shown.output
    assert "bits in words" in shown.output
    assert CliRunner().invoke(app, ["floor", "--preset", "usual-1000baud"]).exit_code == 2
    assert CliRunner().invoke(app, ["floor", "--plant", "nobody", "--rate", "2"]).exit_code == 2


def test_the_rate_of_a_configuration_is_that_of_its_codec() -> None:
    for config in map(load_config, preset_names()):
        rate = bit_rate(build_codec(config), config.timing.tick_s)
        assert configured_rate(config) == pytest.approx(rate), config.preset


@pytest.mark.parametrize(
    "preset",
    [
        "integrator-10baud",
        "pendulum-20baud",
        *(pytest.param(name, marks=pytest.mark.soak) for name in LONG_DESIGNS),
    ],
)
def test_the_constants_of_a_preset_are_those_of_the_design(preset: str) -> None:
    # K is singular at the floor: N is known to fewer digits there, and what follows from it.
    known = {"furuta-50baud": {"worth": 1e-2, "start": 1e-3}, "helicopter-10baud": {"worth": 1e-5}}
    digits = known.get(preset, {})
    values = merged_values(preset)
    again = completed(values)
    for section, names in (
        ("model", ("F", "E")),
        ("coder", ("transition", "noise", "worth", "start", "removed", "step")),
    ):
        for name in set(names) & values[section].keys():
            carried, designed = (np.array(one[section][name]) for one in (values, again))
            within = digits.get(name, 1e-6) * np.abs(designed).max()
            assert np.abs(carried - designed).max() <= within, name
