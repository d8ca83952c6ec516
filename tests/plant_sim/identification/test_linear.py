"""The general algorithm (5)-(10) on plants whose coefficients are known."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.signal import cont2discrete, dlsim

from plant_sim.identification.errors import IdentificationError
from plant_sim.identification.excitation import PseudoRandom
from plant_sim.identification.state_filter import StateFilter
from tests.plant_sim.identification.linear import LinearIdentifier

H = 0.01


def respond(numerator: list[float], denominator: list[float], u: np.ndarray) -> np.ndarray:
    system = cont2discrete((numerator, denominator), H, method="foh")
    return np.asarray(dlsim(system, u)[1]).ravel()


def smooth_input(steps: int) -> np.ndarray:
    signal = PseudoRandom(H, 0.7, 0.2, 1.0)
    raw = np.array([0.0] * 100 + [signal.volts(tick) for tick in range(steps - 100)])
    return np.convolve(raw, np.ones(20) / 20.0)[:steps]


@pytest.mark.parametrize(
    ("numerator", "denominator", "filter_polynomial"),
    [
        ([2.0], [1.0, 0.7], [1.0, 3.0]),
        ([1.5], [1.0, 0.6, 2.0], [1.0, 2.0, 2.0]),
        ([0.5, 1.0], [1.0, 1.0, 3.0], [1.0, 3.0, 4.0]),
        ([1.0, 0.4, 2.0], [1.0, 2.0, 3.0, 1.0], [1.0, 4.0, 6.0, 4.0]),
    ],
)
def test_when_a_plant_of_any_order_is_excited_then_its_coefficients_are_found(
    numerator: list[float], denominator: list[float], filter_polynomial: list[float]
) -> None:
    steps = 8000
    u = smooth_input(steps)
    y = respond(numerator, denominator, u)
    order, input_order = len(denominator) - 1, len(numerator) - 1
    identifier = LinearIdentifier(order, input_order, filter_polynomial, H, gain=1e6)
    for a, b in zip(u.tolist(), y.tolist(), strict=True):
        found = identifier.take(a, b)
    assert found.denominator == pytest.approx(denominator[1:], rel=0.02)
    assert found.numerator == pytest.approx(numerator, rel=0.02)
    assert identifier.warnings() == []


@pytest.mark.parametrize(
    ("polynomial", "text"),
    [
        ([1.0, -2.0, 2.0], "not Hurwitz"),
        ([1.0, 0.0, 2.0], "not Hurwitz"),
        ([2.0, 2.0, 2.0], "begin with 1"),
        ([1.0, math.nan], "finite"),
    ],
)
def test_when_a_filter_makes_no_sense_then_it_is_refused(polynomial: list[float], text: str) -> None:
    with pytest.raises(IdentificationError, match=text):
        StateFilter(polynomial, H, count=2)


def test_when_the_excitation_fades_then_the_gain_stays_bounded_and_the_estimates_rest() -> None:
    excited, quiet = 4000, 30_000  # over the quiet 300 s exp(alpha t) is 1e13
    u = np.concatenate((smooth_input(excited), np.zeros(quiet)))
    noise = np.random.default_rng(3).normal(0.0, 1e-6, len(u))
    y = respond([1.5], [1.0, 0.6, 2.0], u) + noise
    identifier = LinearIdentifier(2, 0, [1.0, 2.0, 2.0], H, forgetting_per_s=0.1)
    for tick, (a, b) in enumerate(zip(u.tolist(), y.tolist(), strict=True)):
        identifier.take(a, b)
        if tick == excited:
            learnt = identifier.estimates
    estimator = identifier.estimator
    assert np.all(np.isfinite(estimator.gain))
    assert np.linalg.eigvalsh(estimator.gain)[0] > 0.0
    assert np.linalg.norm(estimator.gain) <= 10.0 * 1e3 * math.sqrt(3) * (1.0 + 1e-9)
    rested = identifier.estimates
    assert np.array(rested.denominator + rested.numerator) == pytest.approx(
        learnt.denominator + learnt.numerator, rel=0.1
    )


def test_when_one_frequency_excites_three_parameters_too_few_then_a_warning_says_so() -> None:
    identifier = LinearIdentifier(2, 1, [1.0, 2.0, 2.0], H)
    for tick in range(10_000):
        u = math.sin(tick * H)
        identifier.take(u, 0.5 * u)
    assert any("not exciting enough" in text for text in identifier.warnings())
