"""The floor against its two closed forms, against physics, and against what it must refuse."""

from __future__ import annotations

import math

import numpy as np
import pytest

from reproduction.limits.models import integrators, pitch
from tenbaud.bounds.closed import (
    DOUBLE_INTEGRATOR,
    WIENER,
    double_integrator_floor,
    double_integrator_rate,
)
from tenbaud.bounds.floor import (
    RateTooLow,
    floor,
    floor_covariance,
    ideal_worth,
    word_floor,
)
from tenbaud.bounds.linear import LinearModel, linear_model, reached, sampled
from tenbaud.design.described import plant_of, plant_section
from tenbaud.design.plant import floors

PENDULUM = linear_model([[0.0, 1.0], [7.3198**2, 0.0]], [[0.0, 0.0], [0.0, 1e-3]], [1.0, 0.0])


def test_the_constants_are_those_of_the_literature() -> None:
    assert round(WIENER, 3) == 0.721
    assert round(DOUBLE_INTEGRATOR, 3) == 0.890
    assert double_integrator_rate(2e-3, double_integrator_floor(2e-3, 17.0)) == pytest.approx(17.0)


@pytest.mark.parametrize("rate", [0.5, 10.0, 400.0])
def test_when_the_solver_meets_a_closed_form_then_they_agree(rate: float) -> None:
    assert floor(integrators(1, 2e-3), rate) == pytest.approx(WIENER * 2e-3 / rate, rel=1e-8)
    assert floor(integrators(2, 2e-3), rate) == pytest.approx(
        double_integrator_floor(2e-3, rate), rel=1e-8
    )


def test_when_a_chain_is_longer_then_the_floor_falls_with_the_power_that_units_demand() -> None:
    one, other = (floor(integrators(3, 0.5), rate) * rate**5 for rate in (3.0, 30.0))
    assert one == pytest.approx(other, rel=1e-8)


@pytest.mark.parametrize(
    ("bits", "constant"), [(0.25, 0.896), (0.5, 0.917), (1.0, 1.010), (2.0, 1.541), (4.0, 6.044)]
)
def test_when_bits_come_in_words_then_the_double_integrator_pays_for_waiting(
    bits: float, constant: float
) -> None:
    found = word_floor(integrators(2, 2e-3), bits, bits / 10.0) * 10.0**3 / 2e-3
    assert found == pytest.approx(constant, abs=6e-4)


def test_when_words_get_short_then_their_floor_is_that_of_the_flow() -> None:
    model = pitch(2e-3)
    assert word_floor(model, 0.01, 0.001) == pytest.approx(floor(model, 10.0), rel=1e-4)


def test_when_one_state_has_words_then_the_scalar_formula_holds() -> None:
    """P = (a^2 P + q) / 4 per one-bit word: the Gaussian rate-distortion function, step by step."""
    model = linear_model([[-0.3]], [[2.0]], [1.0])
    transition, noise = sampled(model, 0.5)
    a, q = float(transition[0, 0]), float(noise[0, 0])
    after = q / (4.0 - a * a)
    times = np.linspace(0.0, 0.5, 2001)
    grown = np.exp(-0.6 * times) * after + 2.0 * (1.0 - np.exp(-0.6 * times)) / 0.6
    assert word_floor(model, 1.0, 0.5) == pytest.approx(
        float(np.trapezoid(grown, times)) / 0.5, rel=1e-6
    )


def test_when_one_state_flows_then_the_scalar_formula_holds() -> None:
    """R ln 2 = a + q / (2 P)."""
    for a in (-2.0, 0.0, 3.0):
        model = linear_model([[a]], [[0.7]], [1.0])
        expected = 0.7 / (2.0 * (8.0 * math.log(2.0) - a))
        if a < 0.0:
            expected = min(expected, 0.7 / (-2.0 * a))
        assert floor(model, 8.0) == pytest.approx(expected, rel=1e-8)


def test_when_nearby_codes_are_tried_then_none_beats_the_floor() -> None:
    """Any linear observation of the state is a code; its steady filter must stand above the floor."""
    from scipy.linalg import solve_continuous_are

    model = pitch(2e-3, stiffness_per_s2=4.0)
    rng = np.random.default_rng(5)
    gaps = []
    for _ in range(20):
        row = rng.normal(size=(1, 2)) * np.array([1.0, 0.2]) * np.exp(rng.uniform(2.0, 8.0))
        covariance = solve_continuous_are(model.dynamics.T, row.T, model.noise, np.eye(1))
        rate = 0.5 * float((row @ covariance @ row.T)[0, 0]) / math.log(2.0)
        gaps.append(float(covariance[0, 0]) / floor(model, rate))
    assert min(gaps) > 1.0 - 1e-7
    assert min(gaps) < 1.3, "the trial codes came nowhere near, so this shows nothing"


def test_when_a_plant_grows_then_the_floor_rises_without_bound_towards_the_needed_rate() -> None:
    errors = [floor(PENDULUM, rate) for rate in (100.0, 20.0, 12.0, 10.6, 10.57)]
    assert errors == sorted(errors)
    assert errors[-1] > 100.0 * errors[-3]
    assert word_floor(PENDULUM, 1.0, 1.0 / 12.0) > floor(PENDULUM, 12.0)


@pytest.mark.parametrize("solve", [floor, lambda model, rate: word_floor(model, 1.0, 1.0 / rate)])
def test_when_the_rate_is_too_low_then_the_error_says_what_is_needed(solve) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(RateTooLow, match=r"10 bit/s are too few.*more than 10\.56 bit/s"):
        solve(PENDULUM, 10.0)


@pytest.mark.parametrize("rate", [0.0, -1.0, math.nan, math.inf])
def test_when_the_rate_is_no_rate_then_it_is_refused(rate: float) -> None:
    with pytest.raises(ValueError, match="must be above 0"):
        floor(integrators(1, 1.0), rate)


def beside(*densities: float, states: int) -> LinearModel:
    """Return chains of integrators side by side, the first state of each an output."""
    size = len(densities) * states
    dynamics, noise = np.zeros((size, size)), np.zeros((size, size))
    outputs = np.zeros((len(densities), size))
    for axis, density in enumerate(densities):
        own = slice(axis * states, (axis + 1) * states)
        one = integrators(states, density)
        dynamics[own, own], noise[own, own] = one.dynamics, one.noise
        outputs[axis, axis * states] = 1.0
    return linear_model(dynamics, noise, outputs)


def test_when_axes_share_the_bits_then_the_floor_allots_them() -> None:
    """Separate axes: bits go by the root of q to a Wiener process, by its 4th root to a double."""
    wiener = floor(beside(1e-4, 9e-4, states=1), 10.0)
    assert wiener == pytest.approx(WIENER * (0.01 + 0.03) ** 2 / 10.0, rel=1e-8)
    fourth = 2e-6**0.25 + 16e-6**0.25
    double = DOUBLE_INTEGRATOR * fourth**4 / 10.0**3
    assert floor(beside(2e-6, 16e-6, states=2), 10.0) == pytest.approx(double, rel=1e-8)


def test_when_outputs_weigh_more_then_they_are_known_better() -> None:
    model = beside(1e-3, 1e-3, states=1)
    heavy = linear_model(model.dynamics, model.noise, np.eye(2), [4.0, 1.0])
    covariance = floor_covariance(heavy, 10.0)
    assert covariance[1, 1] == pytest.approx(2.0 * covariance[0, 0], rel=1e-6)
    assert floor(heavy, 10.0) == pytest.approx(WIENER * 1e-3 * (2.0 + 1.0) ** 2 / 10.0, rel=1e-8)


@pytest.mark.parametrize(
    ("rate", "degrees"),
    [(10.0, (0.043, 0.043, 0.102)), (20.0, (0.017, 0.018, 0.039)), (30.0, (0.009, 0.010, 0.022))],
)
def test_when_the_axes_of_a_helicopter_are_coupled_then_their_floor_is_the_joint_one(
    rate: float, degrees: tuple[float, ...]
) -> None:
    section = plant_section("helicopter").model_copy(update={"densities": (2e-6, 2e-6, 2e-3)})
    plant = plant_of(section, 0.01)
    assert plant is not None
    found = floors(plant, rate)
    assert found.rms is not None
    assert [math.degrees(rms) for rms in found.rms] == pytest.approx(degrees, abs=6e-4)


def test_when_a_pair_is_unstable_then_both_its_modes_are_paid_for() -> None:
    """Two separate scalar plants, one of them unstable: rates add up as the scalar formula says."""
    q, total = 1e-3, 12.0
    model = linear_model(np.diag([2.0, -1.0]), np.diag([q, q]), np.eye(2))

    def cost(first: float) -> float:
        nats = (first * math.log(2.0), (total - first) * math.log(2.0))
        return q / (2.0 * (nats[0] - 2.0)) + q / (2.0 * (nats[1] + 1.0))

    best = min(cost(first) for first in np.linspace(3.0, 11.9, 200_000))
    assert floor(model, total) == pytest.approx(best, rel=1e-7)


def test_when_the_worth_of_an_error_is_asked_for_then_it_is_the_slope_of_the_floor() -> None:
    covariance, worth = ideal_worth(integrators(2, 2e-3), 10.0)
    values = np.linalg.eigvals(worth @ covariance).real
    # The price of a nat is what the floor falls by.
    slope = 3.0 * double_integrator_floor(2e-3, 10.0) / (10.0 * math.log(2.0))
    assert max(values) == pytest.approx(0.5 * slope, rel=1e-4)
    assert min(values) > 0.0


def test_when_noise_leaves_states_out_then_the_floor_is_that_of_the_others() -> None:
    dynamics = np.array([[0.0, 1.0, 0.3], [0.0, 0.0, 0.2], [0.0, 0.0, -5.0]])
    noise = np.diag([0.0, 2e-3, 0.0])
    part, basis = reached(dynamics, noise, np.array([[1.0, 0.0, 0.0]]), np.ones(1))
    assert basis.shape == (3, 2)
    assert floor(part, 10.0) == pytest.approx(double_integrator_floor(2e-3, 10.0), rel=1e-8)
