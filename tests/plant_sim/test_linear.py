"""The simulated linear plant: its response, its start, what it is off by, and its disturbances."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from plant_sim.linear import SimulatedLinear
from plant_sim.plant import PlantContext
from plant_sim.zero_order_hold import discretised
from tenbaud.design.described import plant_names, plant_section

STEP_S = 0.02
MODEL: dict[str, Any] = {
    "A": ((0.0, 1.0), (-2.0, -0.5)),
    "B": ((0.0,), (3.0,)),
    "C": ((1.0, 0.0),),
}


def plant(
    model: dict[str, Any] = MODEL, *, options: dict[str, Any] | None = None, **context: Any
) -> Any:
    given = {"command_max": (5.0,), "mismatch": 0.0, "disturbance": None, "seed": 1, "model": model}
    return SimulatedLinear(PlantContext(step_s=STEP_S, **{**given, **context}), **(options or {}))


@pytest.mark.parametrize("name", plant_names())
def test_when_a_plant_is_driven_then_its_outputs_are_those_of_control(name: str) -> None:
    import control

    model = plant_section(name).model_dump()
    a, b, c = (np.array(model[one]) for one in "ABC")
    times = np.arange(100) * STEP_S
    commands = np.random.default_rng(3).uniform(-1.0, 1.0, size=(b.shape[1], len(times)))
    system = control.ss(a, b, c, 0.0)
    random = control.forced_response(control.c2d(system, STEP_S), times, commands, squeeze=False)
    steady = control.forced_response(system, times, np.ones_like(commands), squeeze=False)
    for given, expected in ((commands, random.outputs), (np.ones_like(commands), steady.outputs)):
        simulated = plant(model, command_max=(5.0,) * b.shape[1])
        outputs = []
        for command in given.T.tolist():
            outputs.append(simulated.measured)
            simulated.advance(tuple(command))
        assert np.abs(np.array(outputs).T - expected).max() < 1e-9 * np.abs(expected).max()


def test_when_only_the_plant_of_one_tick_is_known_then_it_flies_that() -> None:
    f, e = discretised(MODEL["A"], MODEL["B"], STEP_S)
    discrete = {"F": f.tolist(), "E": e.tolist(), "C": MODEL["C"]}
    one, other = plant(discrete), plant()
    pushed = plant(discrete, disturbance_text="step=1@0", mismatch=0.1)
    same = plant(disturbance_text="step=1@0", mismatch=0.1)
    for simulated in (one, other, pushed, same):
        for _ in range(50):
            simulated.advance((1.0,))
    assert one.state == pytest.approx(other.state, rel=1e-12)
    assert pushed.state == pytest.approx(same.state, rel=1e-8)


def test_when_it_is_about_an_operating_point_then_it_rests_there_off_the_model_too() -> None:
    model = MODEL | {"operating_state": (0.4, 0.0), "operating_command": (2.0,)}
    resting = plant(model, mismatch=0.2)
    assert resting.measured == (0.4,)
    for _ in range(200):
        resting.advance((2.0,))
    assert resting.measured == pytest.approx((0.4,))
    for _ in range(4000):
        resting.advance((3.0,))
    assert resting.measured[0] == pytest.approx(0.4 + 3.0 / 2.0), "one volt more of it"


def test_when_outputs_or_states_are_given_then_it_starts_there() -> None:
    assert plant(initial=(0.3,)).state == (0.3, 0.0)
    assert plant(MODEL | {"start": (0.1, 0.2)}, initial=(0.3,)).state == pytest.approx((0.3, 0.2))
    assert plant(MODEL | {"start": (0.1, 0.2)}).state == (0.1, 0.2)
    assert plant(options={"start": [1.0, 2.0]}).state == (1.0, 2.0)


def test_when_it_is_off_the_model_then_damping_stiffness_and_gain_are() -> None:
    expected = plant({"A": ((0.0, 1.0), (-2.2, -0.4)), "B": ((0.0,), (3.9,)), "C": MODEL["C"]})
    off = plant(mismatch=(-0.2, 0.1, 0.3))
    assert off.constants.transition == pytest.approx(expected.constants.transition)
    assert off.constants.drive[::2] == pytest.approx(expected.constants.drive[::2])


def test_when_options_give_matrices_then_they_are_the_plant() -> None:
    own = plant({}, options={name: MODEL[name] for name in "ABC"})
    own.advance((1.0,))
    other = plant()
    other.advance((1.0,))
    assert own.state == other.state
    with pytest.raises(ValueError, match="no matrices; give A, B and C"):
        plant({})


DISCRETE = {"F": ((1.0, 0.02), (0.0, 1.0)), "E": ((0.0,), (0.02,)), "C": MODEL["C"]}


@pytest.mark.parametrize(
    ("model", "options", "text"),
    [
        (MODEL, {"B": [[1.0]]}, "B must be 2 x 1 finite numbers"),
        (MODEL, {"B": [[1.0, 0.0], [0.0, 1.0]]}, "B must be 2 x 1 finite numbers"),
        (MODEL, {"A": [[1.0], [0.0, 1.0]]}, "A must be rows of numbers, all of one length"),
        (MODEL, {"start": [1.0]}, "start must be 1 x 2"),
        (MODEL, {"C": [[1.0, 0.0], [0.0, 1.0]]}, "C must be 1 x 2 finite numbers"),
        (DISCRETE, {"B": MODEL["B"]}, "model has no A and B; give both, or neither"),
        (DISCRETE, {"A": MODEL["A"]}, "model has no A and B; give both, or neither"),
        ({}, {"C": MODEL["C"]}, "no matrices; give A, B and C"),
        (
            MODEL | {"operating_state": (0.4, 0.0)},
            {"A": [[-1.0]], "B": [[1.0]], "C": [[1.0]]},
            "operating_state must be 1 x 1 finite numbers",
        ),
    ],
)
def test_when_options_do_not_fit_the_model_then_they_are_refused(
    model: dict[str, Any], options: dict[str, Any], text: str
) -> None:
    with pytest.raises(ValueError, match=text):
        plant(model, options=options, outputs=("angle",))


def test_when_several_places_are_disturbed_then_each_has_a_torque_of_its_own() -> None:
    model = {"A": ((0.0, 0.0), (0.0, 0.0)), "B": ((1.0,), (0.0,)), "C": ((1.0, 0.0), (0.0, 1.0))}
    model["G"] = ((1.0, 0.0), (0.0, 1.0))
    shaken = plant(model, disturbance_text="q=4e-2:1e-2,step=0:2@0..1")
    states = []
    for _ in range(5000):
        states.append(shaken.state)
        shaken.advance((0.0,))
    moved = np.diff(np.array(states), axis=0)
    assert moved[50:].var(axis=0) == pytest.approx((4e-2 * STEP_S, 1e-2 * STEP_S), rel=0.1)
    assert abs(np.corrcoef(moved[50:].T)[0, 1]) < 0.06
    assert moved[:50, 1].mean() == pytest.approx(2.0 * STEP_S, abs=0.01)
    again = plant(model, disturbance_text="q=4e-2:1e-2,step=0:2@0..1")
    again.advance((0.0,))
    assert again.state == states[1]
    with pytest.raises(ValueError, match="3 values, and this plant is disturbed in 2 place"):
        plant(model, disturbance_text="q=1:2:3")


def test_when_a_command_is_too_large_or_none_then_it_is_clamped_or_refused() -> None:
    beyond, at_limit = plant(), plant()
    beyond.advance((9.0,))
    at_limit.advance((5.0,))
    assert beyond.state == at_limit.state
    with pytest.raises(ValueError, match="the plant has 1 input"):
        beyond.advance((1.0, 1.0))
    with pytest.raises(ValueError, match="must be finite"):
        beyond.advance((math.nan,))
