"""Which models the limits take, what they need at least, and what is refused."""

from __future__ import annotations

import math

import numpy as np
import pytest

from reproduction.limits.encoder import (
    double_integrator_rate_at_encoder_floor,
    encoder_floor,
)
from reproduction.limits.models import integrators, pitch
from tenbaud.bounds.floor import floor
from tenbaud.bounds.linear import (
    linear_model,
    rate_needed,
    sampled,
)


def test_when_a_plant_does_not_grow_then_no_rate_is_needed() -> None:
    for count in (1, 2, 3, 6):
        assert rate_needed(integrators(count, 1.0).dynamics) == 0.0
    assert rate_needed(pitch(1.0).dynamics) == 0.0


def test_when_a_pendulum_stands_then_its_rate_is_the_published_one() -> None:
    assert rate_needed([[0.0, 1.0], [7.3198**2, 0.0]]) == pytest.approx(10.56, abs=0.005)


def test_when_modes_grow_in_a_pair_then_both_count() -> None:
    dynamics = [[1.0, 5.0], [-5.0, 1.0]]
    assert rate_needed(dynamics) == pytest.approx(2.0 / math.log(2.0))


def test_when_the_body_hangs_upside_down_then_the_pitch_needs_bits() -> None:
    assert rate_needed(pitch(1.0, stiffness_per_s2=4.0, angle_from_rest_rad=math.pi).dynamics) > 2.0


def test_when_an_integrator_chain_is_sampled_then_the_covariance_is_the_textbook_one() -> None:
    transition, noise = sampled(integrators(2, 3.0), 0.2)
    assert np.allclose(transition, [[1.0, 0.2], [0.0, 1.0]])
    assert np.allclose(noise, 3.0 * np.array([[0.2**3 / 3.0, 0.02], [0.02, 0.2]]))


@pytest.mark.parametrize(
    ("dynamics", "noise", "output", "text"),
    [
        ([[0.0, 0.0], [0.0, 1.0]], np.eye(2), [1.0, 0.0], "not observable"),
        ([[0.0, 1.0], [0.0, 0.0]], [[1.0, 0.0], [0.0, 0.0]], [1.0, 0.0], "does not reach every state"),
        ([[0.0, 1.0]], np.eye(2), [1.0, 0.0], "must be 2 x 2"),
        ([[math.nan]], [[1.0]], [1.0], "not finite"),
        ([[0.0]], [[-1.0]], [1.0], "not negative"),
        (np.zeros((2, 2)), [[1.0, 2.0], [0.0, 1.0]], [1.0, 0.0], "symmetric"),
    ],
)
def test_when_a_model_makes_no_sense_then_the_error_says_why(
    dynamics: object, noise: object, output: object, text: str
) -> None:
    with pytest.raises(ValueError, match=text):
        linear_model(dynamics, noise, output)  # type: ignore[arg-type]


def test_when_weights_do_not_fit_the_outputs_then_they_are_refused() -> None:
    for weights in ([1.0], [1.0, -1.0]):
        with pytest.raises(ValueError, match="one for each of the 2 outputs, at least 0"):
            linear_model(np.zeros((2, 2)), np.eye(2), np.eye(2), weights)


def test_when_the_encoder_is_that_of_the_rig_then_its_floor_is_known() -> None:
    assert math.degrees(encoder_floor(4096)) == pytest.approx(0.0254, abs=5e-5)
    with pytest.raises(ValueError, match="at least 1"):
        encoder_floor(0)


@pytest.mark.parametrize(("density", "rate"), [(2e-4, 9.7), (2e-3, 20.9), (2e-2, 44.9)])
def test_when_bits_stop_mattering_then_the_closed_form_and_the_solver_agree(
    density: float, rate: float
) -> None:
    closed = double_integrator_rate_at_encoder_floor(density, 4096)
    assert closed == pytest.approx(rate, abs=0.06)
    solved = floor(integrators(2, density), closed)
    assert math.sqrt(solved) == pytest.approx(encoder_floor(4096), rel=1e-6)
