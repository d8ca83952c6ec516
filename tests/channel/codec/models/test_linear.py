"""The linear model: the plant's own response, outputs, corrections, and what it refuses."""

from __future__ import annotations

import numpy as np
import pytest

from channel.codec.codec import Codec
from channel.codec.coders.zoom import ZoomCoder, ZoomParameters
from channel.codec.models.linear import LinearModel
from plant_sim.zero_order_hold import continuous, discretised
from tenbaud.design.described import plant_names, plant_of, plant_section

TICK_S = 0.01
F = ((1.0, 0.5), (-0.25, 0.75))
E = ((0.0,), (2.0,))
C = ((1.0, 0.0),)


@pytest.mark.parametrize("name", plant_names())
def test_when_a_plant_is_driven_then_its_outputs_are_those_of_control(name: str) -> None:
    import control

    plant = plant_of(plant_section(name), TICK_S)
    assert plant is not None
    transition, drive = discretised(plant.A, plant.B, TICK_S)
    model = LinearModel(transition.tolist(), drive.tolist(), plant.C.tolist(), TICK_S)
    times = np.arange(200) * TICK_S
    commands = np.random.default_rng(3).uniform(-1.0, 1.0, size=(len(plant.B[0]), len(times)))
    sampled = control.c2d(control.ss(plant.A, plant.B, plant.C, 0.0), TICK_S, "zoh")
    expected = control.forced_response(sampled, times, commands, squeeze=False).outputs
    state = model.initial()
    outputs = []
    for command in commands.T.tolist():
        outputs.append(model.measured(state))
        state = model.tick(state, tuple(command), (0.0,) * model.state_size)
    size = np.abs(expected).max()
    assert np.abs(np.array(outputs).T - expected).max() < 1e-9 * size


def test_when_a_plant_is_discretised_then_the_continuous_one_can_be_found() -> None:
    for name in plant_names():
        plant = plant_of(plant_section(name), TICK_S)
        assert plant is not None
        a, b = continuous(*discretised(plant.A, plant.B, TICK_S), TICK_S)
        assert np.allclose(a, plant.A, atol=1e-8)
        assert np.allclose(b, plant.B, atol=1e-8)
    with pytest.raises(ValueError, match="no zero-order hold"):
        continuous([[-0.5]], [[1.0]], TICK_S)


def test_when_a_tick_is_written_out_then_it_is_the_matrix_product() -> None:
    model = LinearModel(F, E, C, TICK_S, start=(0.5, -1.0))
    assert model.initial() == (0.5, -1.0)
    assert model.tick((0.5, -1.0), (0.25,), (0.0, 0.0)) == (0.0, -0.125 - 0.75 + 0.5)
    assert model.measured((0.5, -1.0)) == (0.5,)
    assert model.correction_size == 2


def test_when_it_was_linearised_then_it_rests_at_the_operating_point_and_deviates_from_there() -> None:
    at, under = (0.5, -1.0), (0.25,)
    model = LinearModel(F, E, C, TICK_S, operating=(at, under))
    assert model.initial() == at
    assert model.tick(at, under, (0.0, 0.0)) == at
    about, plain = LinearModel(F, E, C, TICK_S, operating=(at, under)), LinearModel(F, E, C, TICK_S)
    moved = plain.tick((0.25, 0.5), (0.125,), (0.0, 0.0))
    expected = tuple(one + other for one, other in zip(at, moved, strict=True))
    assert about.tick((0.75, -0.5), (0.375,), (0.0, 0.0)) == expected
    with pytest.raises(ValueError, match="row 1 of operating has 2 numbers; 1 are needed"):
        LinearModel(F, E, C, TICK_S, operating=(at, at))


def test_when_only_the_first_states_are_corrected_then_a_held_correction_is_theirs() -> None:
    model = LinearModel(F, E, C, TICK_S, corrected=1)
    assert model.tick((0.0, 0.0), (0.0,), (3.0,)) == (TICK_S * 3.0, 0.0)
    codec = Codec(model, ZoomCoder(ZoomParameters(gains=((1.0,),))), 2)
    state = codec.step(codec.initial(), (1,), [(0.0,)] * 2)
    assert state.model[0] == pytest.approx(2 * TICK_S * 0.5)


@pytest.mark.parametrize(
    ("matrices", "more", "text"),
    [
        ((((1.0, 0.0),), E, C), {}, "row 1 of transition has 2 numbers; 1 are needed"),
        ((F, ((1.0,),), C), {}, "drive has 1 rows"),
        ((F, E, ((1.0,),)), {}, "row 1 of outputs has 1 numbers; 2 are needed"),
        ((F, E, C), {"corrected": 3}, "corrected is 3; it must be 1 to 2"),
        ((F, E, C), {"start": (1.0,)}, "start has 1 numbers"),
        (((), (), ()), {}, "transition has 0 rows"),
    ],
)
def test_when_matrices_do_not_fit_then_the_error_says_which(matrices, more, text: str) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(ValueError, match=text):
        LinearModel(*matrices, TICK_S, **more)
