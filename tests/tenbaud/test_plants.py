"""Each plant of the package flies by its preset: in memory, and as two processes on either clock."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from typer.testing import CliRunner

from channel.protocol.terms import Clock
from tenbaud import fly
from tenbaud.audit.audit import audit
from tenbaud.cli.commands import app
from tenbaud.config.load import load_config
from tests.tenbaud.confirmed import check_flown, held_up


class Flown(NamedTuple):
    """How long a preset flies in memory, and what its outputs must keep to there."""

    seconds: float
    real_s: float
    errors: dict[str, float]
    """largest rms of the live estimate's error"""
    reach: dict[str, float]
    """largest output"""
    bits: int = 1
    """of a word"""


HELICOPTER = {"travel": 1.0, "elevation": 0.45, "pitch": 0.65}
PRESETS = {
    "integrator-10baud": Flown(10.0, 3.0, {"angle": 0.005}, {"angle": 1.0}),
    "servo-10baud": Flown(10.0, 3.0, {"angle": 0.01}, {"angle": 1.5}),
    "aero-20baud": Flown(10.0, 3.0, {"pitch": 0.006, "yaw": 0.006}, {"pitch": 0.5, "yaw": 1.0}),
    "furuta-50baud": Flown(10.0, 2.0, {"arm": 0.02, "pendulum": 0.01}, {"arm": 0.6, "pendulum": 0.2}),
    "heading-1baud": Flown(100.0, 4.0, {"heading": 0.01}, {"heading": 0.6}),
    "helicopter-10baud": Flown(
        10.0,
        3.0,
        {"travel": 0.015, "elevation": 0.015, "pitch": 0.025},
        HELICOPTER,
    ),
    "pendulum-13baud": Flown(10.0, 3.0, {"angle": 0.02}, {"angle": 0.4}),
}
MORE = {
    "helicopter-20baud": Flown(
        10.0, 3.0, {"travel": 0.01, "elevation": 0.01, "pitch": 0.025}, HELICOPTER
    ),
    "helicopter-30baud": Flown(
        10.0, 3.0, {"travel": 0.008, "elevation": 0.008, "pitch": 0.025}, HELICOPTER
    ),
    "helicopter-3x10baud": Flown(
        10.0, 3.0, {"travel": 0.02, "elevation": 0.02, "pitch": 0.03}, HELICOPTER, 3
    ),
    "helicopter-usual": Flown(
        2.0, 1.0, {"travel": 0.005, "elevation": 0.01, "pitch": 0.02}, HELICOPTER, 12
    ),
    "pendulum-16baud": Flown(10.0, 3.0, {"angle": 0.01}, {"angle": 0.3}),
    "pendulum-20baud": Flown(10.0, 3.0, {"angle": 0.006}, {"angle": 0.2}),
}
"""Presets of the same plants at other rates."""
ALIKE = ("integrator-10baud", "servo-10baud", "aero-20baud", "pendulum-13baud", "helicopter-usual")
"""Those that differ in memory alone; two processes fly them in the long tests. The others have the
shortest and the longest period, the most outputs, and words of several bits."""
BETWEEN = ("helicopter-20baud", "pendulum-16baud")
"""Between two other rates of their plant: they fly in the long tests."""
WORDS = tuple(preset for preset, flown in MORE.items() if flown.bits > 1)
"""Those that differ between two processes too: a sample has several bits."""


def check(preset: str, summary: dict[str, Any], tolerance: float = 1.0) -> None:
    outputs, flown = summary["outputs"], (PRESETS | MORE)[preset]
    assert list(outputs) == list(flown.errors)
    for name, output in outputs.items():
        assert 0.0 < output["error_live_rms"] < tolerance * flown.errors[name], name
        assert output["largest"] < flown.reach[name], name


@pytest.mark.parametrize(
    "preset",
    [
        pytest.param(preset, marks=[pytest.mark.soak] if preset in BETWEEN else [])
        for preset in PRESETS | MORE
    ],
)
def test_it_flies_in_memory_and_every_output_is_known(preset: str, tmp_path: Path) -> None:
    seconds = (PRESETS | MORE)[preset].seconds
    run = fly(preset, settings={"duration_s": seconds}, out=tmp_path / "run")
    check_flown(run.summary, run.summary["samples"], bits=(PRESETS | MORE)[preset].bits)
    check(preset, run.summary)


def test_presets_are_listed_by_plant_with_their_rates() -> None:
    shown = CliRunner().invoke(app, ["presets"]).output
    plants: dict[str, str] = {}
    for line in shown.splitlines():
        plant, _, rest = line.partition("  ")
        plants[plant or list(plants)[-1]] = plants.get(plant or list(plants)[-1], "") + rest
    named = {"pitch": ["paper-10baud"], "pendulum": ["pendulum-30baud"]}
    for preset in PRESETS | MORE:
        named.setdefault(preset.rpartition("-")[0], []).append(preset)
    assert plants.keys() == named.keys()
    for plant, presets in named.items():
        for preset in presets:
            rate = load_config(preset).channel.rate_baud
            assert re.search(rf"{preset} +{rate:g} baud  \w", plants[plant]), plant


def _as_processes() -> Iterator[Any]:
    for preset in (*PRESETS, *WORDS):
        soak = [pytest.mark.soak] if preset in ALIKE else []
        yield pytest.param(preset, "virtual", marks=soak)
        if preset == "helicopter-10baud":
            soak = [pytest.mark.soak]  # with an emulated rig in test_three_axes.py and test_motors.py
        if preset in PRESETS:
            yield pytest.param(preset, "real", marks=[*soak, pytest.mark.real_time])


@pytest.mark.parametrize(("preset", "clock"), tuple(_as_processes()))
def test_it_flies_as_two_processes(preset: str, clock: Clock, tmp_path: Path) -> None:
    period_s = load_config(preset).timing.symbol_period_s
    samples = round((PRESETS | MORE)[preset].real_s / period_s)
    settings = {"duration_s": samples * period_s, "transmitter.watchdog_s": 30.0}
    run = fly(preset, settings=settings, out=tmp_path / "run", link="zenoh", clock=clock)
    check_flown(run.summary, samples, bits=(PRESETS | MORE)[preset].bits)
    result = audit(tmp_path / "run")
    assert result.passed, result.leaks + result.gaps
    if clock == "virtual" or held_up(run.summary) is None:
        # The first seconds, and on the real clock the command lead, add to the error.
        check(preset, run.summary, 3.0 if clock == "virtual" else 6.0)


def test_when_the_helicopter_is_off_then_its_flight_says_by_how_much(tmp_path: Path) -> None:
    settings = {"duration_s": 20.0, "transmitter.plant.mismatch": (0.1, -0.1, 0.1)}
    run = fly("helicopter-10baud", settings=settings, out=tmp_path / "run")
    learned = run.summary["learned"]
    for name, off in (("pitch_thrust", 0.1), ("elevation_weight", -0.1), ("elevation_thrust", 0.1)):
        error, deviation = learned[name]["error"], learned[name]["deviation"]
        assert abs(error - off) < 4.0 * deviation < 0.4, name
        assert 0.0 < deviation < 0.1, name
        assert run.values_of(f"estimate_{name}_error")[-1] == pytest.approx(error, abs=0.05), name
