"""Plants of equations: exact, of the published parameters, and near the models of their presets."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from plant_sim.furuta import FurutaPlant
from plant_sim.helicopter import PITCH_STOP_RAD, HelicopterPlant, force_of, volts_of
from plant_sim.ode import OdePlant
from plant_sim.plant import PlantContext
from plant_sim.servo import ServoPlant
from tenbaud.config.load import load_config
from tenbaud.design.described import linear_of

STEP_S = 0.004


def built(kind: type[OdePlant], inputs: int, step_s: float = STEP_S, **given: Any) -> Any:
    options = given.pop("options", {})
    context = {"seed": 1, "command_max": (10.0,) * inputs, "mismatch": 0.0, "disturbance": None}
    return kind(PlantContext(step_s=step_s, **{**context, **given}), **options)


@pytest.mark.parametrize(
    ("kind", "initial", "command", "lag_s", "steps"),
    [
        (ServoPlant, (0.5,), (3.0,), 0.002, 100),
        (FurutaPlant, (0.1, 0.3), (-2.0,), 1e-9, 25),
        (HelicopterPlant, (0.1, 0.3, -0.2), (4.0, 2.5), 0.08, 100),
    ],
)
def test_when_a_plant_is_driven_then_it_follows_its_equations(
    kind: type[OdePlant],
    initial: tuple[float, ...],
    command: tuple[float, ...],
    lag_s: float,
    steps: int,
) -> None:
    from scipy.integrate import solve_ivp

    plant = built(kind, len(command), initial=initial)
    begun, motors, places = plant.state, np.array(plant.motors), len(plant._still)

    def slope(time_s: float, state: Any) -> Any:
        lagging = command + (motors - command) * math.exp(-time_s / lag_s)
        still = (0.0,) * places
        return plant.slopes(tuple(state), tuple(lagging), still, plant.constants, math.sin)

    exact = solve_ivp(slope, (0.0, steps * STEP_S), begun, rtol=1e-9, atol=1e-12, max_step=0.001)
    for _ in range(steps):
        plant.advance(command)
    assert plant.state == pytest.approx(tuple(exact.y[:, -1]), rel=1e-3, abs=1e-4)
    assert np.abs(np.array(plant.state) - begun).max() > 0.2, "it has moved"


@pytest.mark.parametrize(
    ("kind", "preset"),
    [
        (ServoPlant, "servo-10baud"),
        (FurutaPlant, "furuta-50baud"),
        (HelicopterPlant, "helicopter-10baud"),
    ],
)
def test_when_it_is_linearised_then_it_is_the_model_of_its_preset(
    kind: type[OdePlant], preset: str
) -> None:
    linear = linear_of(load_config(preset).model)
    assert linear is not None
    model = linear.model_dump()
    a, b, c, g = (np.array(model[one]) for one in "ABCG")
    inputs, size = b.shape[1], model["corrected"] or len(a)
    options = {} if kind is HelicopterPlant else {"friction": 0.0, "rod_damping": 0.0}
    options = {"friction_rad_per_s2": 0.0} if kind is ServoPlant else options
    plant = built(kind, inputs, options=options)
    places, count = len(plant._still), len(plant.state)
    # The plant has outputs first, then rates; the model may have them in another order.
    outputs = [int(row.argmax()) for row in c]
    order = np.array([*outputs, *[int(a[one].argmax()) for one in outputs]])

    def slopes(values: Any) -> Any:
        split = np.split(values, [count, count + inputs])
        state, motors, torques = (tuple(one.tolist()) for one in split)
        return np.array(plant.slopes(state, motors, torques, plant.constants, math.sin))

    at = np.array([*plant.state, *plant.motors, *[0.0] * places])
    assert np.abs(slopes(at)).max() < 1e-9, "at rest"
    near = 1e-6 * np.eye(len(at))
    found = np.array([(slopes(at + one) - slopes(at - one)) / 2e-6 for one in near]).T
    states, motors, torques = np.split(found, [count, count + inputs], axis=1)
    reached = a[:size, size:] if size < len(a) else b
    scale = np.abs(found).max()
    assert np.abs(states - a[np.ix_(order, order)]).max() < 1e-4 * scale
    assert np.abs(motors - reached[order]).max() < 1e-4 * scale
    assert np.abs(torques - g[order]).max() < 1e-4 * scale


def test_when_a_frictionless_furuta_swings_then_its_energy_stays() -> None:
    options = {"friction": 0.0, "rod_damping": 0.0}
    plant = built(FurutaPlant, 1, 0.001, mismatch=(-1.0, 0.0, 0.0), initial=(0.0, 2.0), options=options)

    def energy() -> float:
        (_, rod, arm_rate, rod_rate), one = plant.state, plant.constants
        turning = (one.a + one.b * math.sin(rod) ** 2) * arm_rate**2 + one.d * rod_rate**2
        return 0.5 * turning - one.c * math.cos(rod) * arm_rate * rod_rate + one.e * math.cos(rod)

    energies = []
    for _ in range(2000):
        energies.append(energy())
        plant.advance((0.0,))
    assert np.ptp(energies) < 1e-5 * abs(plant.constants.e)
    assert abs(plant.state[2]) > 0.1, "the arm swings too"


@pytest.mark.parametrize(
    ("volts", "force"), [(5.0, 1.0), (1.0, 0.1111), (-5.02, -0.23), (-0.5, -0.012)]
)
def test_when_a_rotor_has_a_voltage_then_its_force_is_the_benchmark_s(
    volts: float, force: float
) -> None:
    assert force_of(volts) == pytest.approx(force, abs=1e-4)


def test_when_the_helicopter_hovers_then_it_needs_the_benchmark_s_voltages() -> None:
    for degrees, volts in ((10.0, 2.68), (20.0, 4.8)):
        angle = math.radians(degrees)
        plant = built(HelicopterPlant, 2, initial=(0.2, angle))
        assert plant.motors == pytest.approx((volts, volts), abs=0.01)
        for _ in range(500):
            plant.advance(plant.motors)
        assert plant.measured == pytest.approx((0.2, angle, 0.0), abs=1e-9)
    for volts in (0.0, 0.3, 1.0, 4.9):
        assert volts_of(force_of(volts)) == pytest.approx(volts)


def test_when_the_helicopter_is_turned_too_far_then_a_stop_holds_it() -> None:
    plant = built(HelicopterPlant, 2)
    seen = []
    for _ in range(1500):
        plant.advance((5.0, 0.0))
        seen.append(plant.measured[2])
    assert max(seen) < 1.6 * PITCH_STOP_RAD
    assert seen[-1] == pytest.approx(PITCH_STOP_RAD, abs=0.05)


def test_when_an_axis_is_pushed_then_only_that_one_answers_first() -> None:
    plant = built(HelicopterPlant, 2, disturbance_text="step=0:0:0.5@0")
    still = built(HelicopterPlant, 2)
    plant.advance(plant.motors)
    still.advance(still.motors)
    moved = np.array(plant.state) - np.array(still.state)
    assert moved[5] == pytest.approx(0.5 * STEP_S, rel=1e-3)
    assert np.abs(moved[[0, 1, 3, 4]]).max() < 1e-5


def test_when_the_mass_is_sent_along_the_arm_then_it_moves_at_its_screw_s_speed() -> None:
    options = {"mass_moves": [[1.0, 0.08], [4.0, 0.0]], "mass_rad_per_s2_per_m": 5.0}
    plant = built(HelicopterPlant, 2, step_s=0.5, options=options)
    pushes = plant.pushes(12)
    assert pushes[:, 1] == pytest.approx([0, 0, 0, -0.2, *[-0.4] * 5, -0.2, 0, 0])
    assert [plant._disturbances[1].torque(step) for step in range(12)] == pytest.approx(pushes[:, 1])
    assert not pushes[:, [0, 2]].any()


def test_when_the_helicopter_is_of_the_second_rig_then_it_hovers_on_its_own_parameters() -> None:
    plant = built(HelicopterPlant, 2, options={"rig": "ctu"})
    assert plant.motors == pytest.approx((6.33, 6.33), abs=0.01)
    for _ in range(500):
        plant.advance(plant.motors)
    assert plant.measured == pytest.approx((0.0, math.radians(10.0), 0.0), abs=1e-9)


def test_when_travel_goes_too_far_then_a_stop_holds_it() -> None:
    plant = built(HelicopterPlant, 2, options={"travel_stop_rad": 0.3}, initial=(0.25, 0.17, -0.3))
    for _ in range(1000):
        plant.advance((2.68, 2.68))
    assert abs(plant.measured[0]) < 0.4
    plant = built(HelicopterPlant, 2, model={"travel_stop_rad": 20.0}, initial=(4.0, 0.17, 0.0))
    plant.advance((0.0, 0.0))
    assert plant.measured[0] == pytest.approx(4.0), "its default is that of the codec's model"
    plant = built(HelicopterPlant, 2, initial=(0.0, 0.0))
    for _ in range(500):
        plant.advance((0.0, 0.0))
    assert plant.measured == pytest.approx((0.0, 0.0, 0.0)), "without thrust it rests, level"


def test_when_friction_holds_a_servo_then_it_is_slower() -> None:
    free, rubbing = (
        built(ServoPlant, 1, options={"friction_rad_per_s2": friction}) for friction in (0.0, 2.0)
    )
    for _ in range(500):
        free.advance((1.0,))
        rubbing.advance((1.0,))
    assert free.state[1] == pytest.approx(1.0, abs=1e-6)
    assert rubbing.state[1] == pytest.approx(0.8, abs=0.02)


MASS = {"mass_moves": [[1.0, 0.08]]}


@pytest.mark.parametrize(
    ("kind", "options", "text"),
    [
        (ServoPlant, {"time_constant_s": 0.0}, "time_constant_s is 0.0; it must be above 0"),
        (FurutaPlant, {"friction": -1.0}, "friction is -1.0; it must be finite and at least 0"),
        (HelicopterPlant, {"motor_lag_s": math.inf}, "motor_lag_s is inf"),
        (HelicopterPlant, {"rig": "mine"}, "rig is 'mine'; known are laas, ctu"),
        (HelicopterPlant, {"travel_stop_rad": 0.0}, "travel_stop_rad is 0.0"),
        (HelicopterPlant, {"mass_moves": [[1.0, 0.2]]}, "0.2 m; its screw ends at 0.1397 m"),
        (HelicopterPlant, {"mass_moves": [[1.0, 0.08], [1.5, 0.0]]}, "moving until 2 s"),
        (HelicopterPlant, {"mass_moves": [[1.0]]}, r"moves, \[time in s, position in m\] each"),
        (HelicopterPlant, {"mass_moves": [10.0, 0.08]}, r"mass_moves has 10\.0; it is a list of moves"),
        (
            HelicopterPlant,
            {"mass_moves": [["1", 0.08]]},
            r"mass_moves has \['1', 0\.08\]; it is a list",
        ),
        (
            HelicopterPlant,
            {"mass_moves": [[-1.0, 0.08]]},
            "a move begins at -1 s, and the flight at 0 s",
        ),
        (HelicopterPlant, {"mass_rad_per_s2_per_m": 4.0}, "no mass moves: give mass_moves too"),
        *(
            (
                HelicopterPlant,
                {**MASS, "mass_rad_per_s2_per_m": pull},
                "mass_rad_per_s2_per_m is .* at least 0",
            )
            for pull in (-1.0, math.nan, math.inf, 1e300)
        ),
        (ServoPlant, {"winding_lag_s": -1.0}, "winding_lag_s is -1.0"),
    ],
)
def test_when_an_option_makes_no_plant_then_it_is_refused(
    kind: type[OdePlant], options: dict[str, float], text: str
) -> None:
    with pytest.raises(ValueError, match=text):
        built(kind, 2, options=options)
