"""Plants from python-control and scipy, and what is given beside them, refused in words."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tenbaud.errors import ConfigError
from tests.tenbaud.flight.systems import NAMED, A, B, C, flown, pendulum

CASES = 37
Case = tuple[Any, dict[str, Any], str]
"""A plant, what is given beside it, and the words of the error."""


def refused_plants() -> list[Case]:
    import control

    return [
        (
            control.ss(A, B, C, [[0.5]], **NAMED),
            {},
            r"D is not zero: output angle \[rad\] has 0\.5 of inp",
        ),
        (control.ss(A, B, C, 0, True), {}, "discrete and its dt is not given"),
        (control.ss([], [], [], [[1.0]]), {}, "no states"),
        (control.ss(A, B, C, 0, states=["a", "a"]), {}, r"2 state\(s\) and names 1: a"),
        (control.ss(A, B, C, 0, states=["a b", "A_b"]), {}, "states: a_b is named twice"),
        (control.ss(A, B, C, 0, states=["a!", "b"]), {}, "'a!' is no name of a signal"),
        (
            control.ss(A, B, C, 0, states=["a [rad]", "b"], outputs=["y [deg]"]),
            {},
            "units contradict: the output y is the state a, and they are in deg and rad",
        ),
        (
            control.ss([[0.0, 1.0], [0.0, -1.0]], B, [[0.0, 1.0]], 0),
            {},
            r"eigenvalue 0 1/s, mostly of state_1, .*\(A, C\), by the weights, is not observable",
        ),
        (
            control.ss([[1.0, 0.0], [0.0, -1.0]], B, [[1.0, 1.0]], 0, states=["up", "down"]),
            {},
            r"eigenvalue 1 1/s, mostly of up, .*\(A, G\) is not controllable",
        ),
        (
            control.ss([[1.0, 0.0], [0.0, -1.0]], B, [[1.0, 1.0]], 0, states=["up", "down"]),
            {"settings": {"model.G": [[1.0], [1.0]], "model.densities": [1e-3]}},
            r"eigenvalue 1\.01\d+ per tick, mostly of up: the pair \(A, B\) is not controllable",
        ),
        (
            control.ss([[0.0, 1.0], [53.6, 0.0]], B, C, 0, states=["angle", "rate"]),
            {},
            r"10 bit/s are too few: .* rate fastest by 7\.321 1/s, .*more than 10\.56 bit/s",
        ),
        (
            control.sample_system(control.ss(A, B, C, 0), 0.05),
            {"settings": {"timing.tick_s": 0.02}},
            r"dt = 0\.05 s .* is 2\.5 ticks of timing\.tick_s = 0\.02 s",
        ),
        (pendulum(drift=0.1), {}, r"not autonomous: d/dt of state rate is .* at 0 s and .* at 0\.37 s"),
        (
            pendulum(),
            {"operating_point": ([0.5, 0.0], [0.0])},
            r"not an equilibrium: state rate moves by -4\.70316 a second",
        ),
        (pendulum(), {"operating_point": ([0.5], [0.0])}, r"states \[0\.5\]; 2 finite numbers"),
        (pendulum(), {"operating_point": 3.0}, "must be a pair"),
    ]


def refused_beside_plants() -> list[Case]:
    import control

    return [
        (control.ss(A, B, C, 0), {"operating_point": ([0, 0], [0])}, "this one has matrices"),
        (control.ss(A, B, C, 0), {"controller": [[1.0, 2.0, 3.0]]}, "1 row.* of 3 .* a row needs 2"),
        (
            control.ss(A, B, C, 0),
            {"controller": [-1.0, -2.0]},
            r"do not hold the plant: .* factor 1\.00\d+ per tick, mostly of state_1",
        ),
        (
            control.ss(A, B, C, 0),
            {"controller": {"k": 1.0}},
            "dict. is no controller: it has no method",
        ),
        (control.ss(A, B, C, 0), {"reference": "up"}, "reference: could not convert"),
        (control.ss(A, B, C, 0), {"reference": {"yaw": 1.0}}, "'yaw' is none of the outputs: output_1"),
        (
            control.ss(A, B, C, 0),
            {"reference": ([0, 1], [1.0])},
            "2 rising times are needed for 1 rows",
        ),
        (
            control.ss(A, B, C, 0),
            {"reference": np.zeros((9, 2))},
            "2 values at a time, and there are 1 output",
        ),
        (
            control.ss(A, B, C, 0),
            {"reference": lambda t: math.nan if t > 1.0 else 0.0},
            r"reference of output_1 is nan at 1\.01 s",
        ),
        (pendulum(), {"settings": {"transmitter.plant.mismatch": 0.1}}, "mismatch is for plants with"),
        (
            "servo-10baud",
            {
                "plant": control.nlsys(
                    lambda t, x, u, params: 0.9 * x + u, None, inputs=1, states=1, outputs=1, dt=0.1
                )
            },
            r"its dt is 0\.1 s and timing\.tick_s = 0\.01 s",
        ),
        *[
            (control.ss(A, B, C, 0), given, text)
            for given, text in (
                ({"rate_baud": 0.0}, r"channel\.rate_baud = 0\.0: .* greater"),
                ({"rate_baud": math.nan}, r"channel\.rate_baud = nan: .* finite"),
                (
                    {"rate_baud": 5.0, "settings": {"channel.rate_baud": 20.0}},
                    r"rate_baud = 5\.0 and channel\.rate_baud = 20\.0: give one rate",
                ),
                (
                    {"settings": {"limits.command_max": [5.0, 5.0]}},
                    r"limits\.command_max = .* has 2 values; the plant has 1 input\(s\): input_1",
                ),
                ({"settings": {"limits.command_max": [0.0]}}, r"limits\.command_max.* greater"),
                ({"settings": {"limits.command_max": -1}}, r"limits\.command_max = -1: .* greater"),
                ({"settings": {"model.densities": 0.002}}, r"model\.densities = 0\.002: give a list"),
                ({"settings": {"timing.tick_s": 0.0}}, r"timing\.tick_s = 0\.0: .* above 0"),
            )
        ],
        ("tuned-10baud", {"rate_baud": 20.0}, "a preset says them itself"),
        (3.0, {}, "a float is neither the name of a preset nor a plant"),
    ]


@pytest.mark.parametrize("number", range(CASES))
def test_when_a_plant_cannot_be_flown_then_the_error_names_signal_and_number(
    number: int, tmp_path: Path
) -> None:
    cases = [*refused_plants(), *refused_beside_plants()]
    assert len(cases) == CASES
    system, given, text = cases[number]
    with pytest.raises(ConfigError, match=text):
        flown(system, tmp_path, **given)
    assert not (tmp_path / "run").exists()
