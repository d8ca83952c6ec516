"""Designing the direction coder: near the floor in a simulation, for every plant, and refusals."""

from __future__ import annotations

import math
import random
from dataclasses import replace

import numpy as np
import pytest

from channel.codec.coders.direction import DirectionCoder
from tenbaud.bounds.floor import RateTooLow, floor, period_cost
from tenbaud.bounds.linear import sampled
from tenbaud.design.described import corrected_part, plant_names, plant_of, plant_section
from tenbaud.design.direction import design_direction
from tenbaud.design.plant import LinearPlant, linear_plant

RATES = {"pendulum": 20.0, "furuta": 50.0, "cart-pole": 30.0, "heading": 1.0}


def plant_named(name: str) -> LinearPlant:
    plant = plant_of(plant_section(name), 0.01)
    assert plant is not None
    return plant


def over_floor(plant: LinearPlant, coder: DirectionCoder, rate: float, samples: int) -> float:
    """Return the rms over the floor, the plant being the model; as in `benchmarks/direction.py`."""
    model = plant.model()
    bits = coder.alphabet.symbols_per_word
    F, Q = sampled(model, bits / rate)
    M, between = period_cost(model, bits / rate)
    root = np.linalg.cholesky(Q + 1e-13 * np.diag(np.diag(Q)))
    rng = np.random.default_rng(2)
    error, zero, total = np.zeros(len(F)), (0.0,) * len(F), 0.0
    state = coder.initial()
    for sample in range(samples):
        word = coder.encode(state, zero, tuple(error.tolist()))
        correction, state = coder.decode(state, zero, word)
        error = error - np.array(correction)
        total += float(error @ M @ error) if sample >= 100 else 0.0
        error = F @ error + root @ rng.standard_normal(len(F))
    return math.sqrt((total / (samples - 100) + between) / floor(model, rate))


@pytest.mark.parametrize(
    ("name", "rate", "most"), [("integrator", 10.0, 1.8), ("pendulum", 20.0, 2.3), ("aero", 20.0, 1.8)]
)
def test_when_a_plant_is_its_model_then_the_error_is_near_the_floor(
    name: str, rate: float, most: float
) -> None:
    plant = plant_named(name)
    known = DirectionCoder(design_direction(plant, rate, 1.0 / rate, adapts=False))
    assert 1.3 < over_floor(plant, known, rate, 4000) < most


def test_when_a_sample_has_several_bits_then_they_share_its_directions() -> None:
    plant = plant_named("aero")
    coder = DirectionCoder(design_direction(plant, 20.0, 0.15))
    assert coder.alphabet.symbols_per_word == 3
    assert over_floor(plant, coder, 20.0, 3000) < 2.1


@pytest.mark.parametrize("name", plant_names())
def test_when_a_plant_of_the_box_is_designed_for_then_its_coder_is_one(name: str) -> None:
    rate = RATES.get(name, 10.0)
    parameters = design_direction(plant_named(name), rate, 1.0 / rate)
    coder = DirectionCoder(parameters)
    state = coder.initial()
    assert coder.is_state(state)
    assert (np.linalg.eigvalsh(np.array(parameters.start)) > 0.0).all()
    chooser = random.Random(1)
    zero = (0.0,) * coder.correction_size
    for _ in range(50):
        correction, state = coder.decode(state, zero, (chooser.choice((-1, 1)),))
        assert all(map(math.isfinite, (*correction, *state)))


def test_when_states_are_counted_in_other_units_then_the_coder_is_the_same() -> None:
    plant = plant_named("integrator")
    one = design_direction(plant, 10.0, 0.1)
    other = design_direction(
        linear_plant([[0.0, 1e-3], [0.0, 0.0]], [[0.0], [1e3]], [[1.0, 0.0]], densities=2e-3), 10.0, 0.1
    )
    assert other.start[1][1] == pytest.approx(1e6 * one.start[1][1], rel=0.01)
    assert other.start[0][0] == pytest.approx(one.start[0][0], rel=0.01)
    assert replace(other, **dict.fromkeys(("transition", "noise", "worth", "start"), ())) == replace(
        one, **dict.fromkeys(("transition", "noise", "worth", "start"), ())
    )


def test_when_the_rate_is_too_low_then_the_error_has_both_numbers() -> None:
    with pytest.raises(RateTooLow, match=r"10 bit/s are too few.*more than 10\.56 bit/s"):
        design_direction(plant_named("pendulum"), 10.0, 0.1)


def test_when_a_word_has_no_whole_number_of_bits_then_it_is_refused() -> None:
    with pytest.raises(ValueError, match="a word has a whole number"):
        design_direction(plant_named("integrator"), 10.0, 0.15)


def test_when_only_the_first_states_are_corrected_then_the_others_must_be_known() -> None:
    lagging = linear_plant(
        [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -5.0]],
        [[0.0], [0.0], [5.0]],
        [[1.0, 0.0, 0.0]],
        [[0.0], [1.0], [0.0]],
    )
    assert corrected_part(lagging, 2).A.tolist() == [[0.0, 1.0], [0.0, 0.0]]
    with pytest.raises(ValueError, match="only the first 1 of 3 states take corrections"):
        corrected_part(lagging, 1)
