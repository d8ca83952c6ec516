"""The helicopter that the codec predicts: that of the simulation, stops included, and its rest."""

from __future__ import annotations

import math
import random

import numpy as np
import pytest
from scipy.linalg import expm

from channel.codec.codec import Vector
from channel.codec.models.helicopter import HelicopterModel, helicopter_tick
from channel.codec.models.learned import plant_model
from plant_sim.helicopter import HelicopterPlant
from plant_sim.plant import PlantContext
from tenbaud.build.codec import build_model
from tenbaud.config.load import load_config
from tenbaud.config.schema import FlightConfig
from tenbaud.design.described import linear_of
from tenbaud.studies.compiled import arrays_of, compiled

NOTHING: Vector = (0.0,) * 6


def model_and_plant() -> tuple[HelicopterModel, HelicopterPlant]:
    config = load_config("helicopter-10baud")
    model = plant_model(build_model(config))
    assert isinstance(model, HelicopterModel)
    context = PlantContext(
        step_s=config.timing.tick_s, seed=1, command_max=(5.0, 5.0), mismatch=0.0, disturbance=None
    )
    return model, HelicopterPlant(context)


def test_when_model_and_plant_have_the_same_commands_then_they_fly_alike_to_their_stops() -> None:
    model, plant = model_and_plant()
    draw = random.Random(3)
    state = model.initial()
    assert (*plant.state, *plant.motors) == pytest.approx(state, abs=1e-12)
    highest, tilted = 0.0, 0.0
    for tick in range(2000):
        if tick % 80 == 0:
            both, turn = 5.0 if tick >= 1000 else 0.0, draw.uniform(-5.0, 5.0)
            command = (both or turn, both or -turn)
        state = model.tick(state, command, NOTHING)
        plant.advance(command)
        assert (*plant.state, *plant.motors) == pytest.approx(state, rel=1e-9, abs=1e-9), tick
        highest, tilted = max(highest, state[1]), max(tilted, abs(state[2]))
    assert tilted > math.radians(32.0), "it met a stop of the pitch"
    assert highest > math.radians(30.0), "and one of the elevation"


def test_when_a_tick_is_compiled_then_no_bit_differs() -> None:
    model, _ = model_and_plant()
    constants, tick = arrays_of(model.constants), compiled(helicopter_tick)
    state = model.initial()
    for number in range(300):
        command = (4.5 if number % 70 < 40 else -3.0, 0.3 if number % 90 < 50 else 4.0)
        after = model.tick(state, command, NOTHING)
        assert tick(state, command, NOTHING, constants) == after, number
        state = after
    assert abs(state[2]) > 0.1


def test_when_a_correction_is_held_then_it_is_added_to_every_derivative() -> None:
    model, _ = model_and_plant()
    for place in range(6):
        held = tuple([0.01 * (at == place) for at in range(6)])
        hover = model.initial()
        moved = np.subtract(model.tick(hover, hover[6:], held), model.tick(hover, hover[6:], NOTHING))
        assert moved[place] == pytest.approx(1e-4, rel=2e-2)


@pytest.mark.parametrize("hover_rad", [0.05, 0.17453292519943295])
def test_the_described_plant_is_the_model_s_derivative_at_its_rest(hover_rad: float) -> None:
    config = FlightConfig.model_validate({"model": {"kind": "helicopter", "hover_rad": hover_rad}})
    model, linear = build_model(config), linear_of(config.model)
    assert linear is not None
    rest = np.array(linear.operating_state)
    command = np.array(linear.operating_command)
    assert model.initial() == tuple(rest)

    def tick(state: np.ndarray, volts: np.ndarray) -> np.ndarray:
        return np.array(model.tick(tuple(state.tolist()), tuple(volts.tolist()), NOTHING))

    assert np.abs(tick(rest, command) - rest).max() < 1e-12, "at rest"
    near, tick_s = 1e-6, config.timing.tick_s
    found = np.array(
        [tick(rest + near * one, command) - tick(rest - near * one, command) for one in np.eye(8)]
    ).T / (2.0 * near)
    assert np.abs(found - expm(tick_s * np.array(linear.A))).max() < 1e-6
