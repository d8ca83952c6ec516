"""Symbols of a known plant: what the filter makes of one, and what the search finds in many."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import cast

import numpy as np
import pytest

from plant_sim.identification.filters import Array
from plant_sim.identification.from_symbols import identify_symbols
from plant_sim.identification.likelihood import follow, update
from plant_sim.identification.structures import parse_linear
from plant_sim.identification.symbols import Symbols
from tenbaud.studies.compiled import compiled

Filter = Callable[..., float]

PERIOD_S = 0.1
TICKS = 5


@pytest.mark.parametrize(
    ("low", "high"), [(0.3, math.inf), (-math.inf, -1.0), (-0.2, 0.5), (4.0, math.inf)]
)
def test_when_a_symbol_is_taken_then_mean_and_covariance_are_those_of_the_cut_normal(
    low: float, high: float
) -> None:
    wrong, spread = 0.02, 0.1
    mean, P, c = np.array([0.2, -0.4]), np.array([[0.5, 0.2], [0.2, 0.3]]), np.array([1.0, -0.5])
    sides = np.linspace(-7.0, 7.0, 701)
    points = np.stack(np.meshgrid(sides, sides), axis=-1).reshape(-1, 2)
    x = mean + points @ np.linalg.cholesky(P).T
    weights = np.exp(-0.5 * (points**2).sum(axis=1))
    weights /= weights.sum()
    erf = np.vectorize(math.erf)
    lower, upper = (erf((edge - x @ c) / math.sqrt(2.0 * spread)) for edge in (low, high))
    chance = 0.5 * wrong + (1.0 - wrong) * 0.5 * (upper - lower)
    after = weights * chance / (weights @ chance)
    found, spread_found = mean.copy(), P.copy()
    log = update(c, low, high, spread, wrong, found, spread_found, np.empty(2))
    assert log == pytest.approx(math.log(weights @ chance), abs=1e-6)
    assert found == pytest.approx(after @ x, abs=1e-6)
    off = x - after @ x
    assert spread_found == pytest.approx((off * after[:, None]).T @ off, abs=1e-5)


def flight(seconds: float, flipped: float, moves: float = 1.0) -> Symbols:
    """Return the signs of y'' = -0.8 y' - 2 y + 1.5 u + noise against an estimate that chases y."""
    random = np.random.default_rng(5)
    samples = round(seconds / PERIOD_S)
    inputs = np.repeat(moves * random.choice([-1.0, 1.0], samples // 5), 5 * TICKS)
    step_s = PERIOD_S / TICKS
    y, rate, x, reach = 0.0, 0.0, 0.0, 0.1
    signs, edges = [], []
    for k in range(samples):
        sign = 1 if y >= x else -1
        edges.append(x)
        x += sign * reach
        reach *= 1.3 if signs and sign == signs[-1] else 0.8
        reach = min(max(reach, 0.005), 0.5)
        signs.append(-sign if random.random() < flipped else sign)
        for tick in range(TICKS):
            push = 0.02 * random.standard_normal() / math.sqrt(step_s)
            rate += step_s * (-0.8 * rate - 2.0 * y + 1.5 * inputs[k * TICKS + tick] + push)
            y += step_s * rate
    up = np.array(signs) > 0
    lows, highs = np.where(up, edges, -np.inf), np.where(up, np.inf, edges)
    combinations = np.tile([1.0, 0.0], (samples, 1))
    estimates = np.stack((edges, np.gradient(edges, PERIOD_S)), axis=1)
    return Symbols(
        PERIOD_S, np.arange(samples + 1), combinations, lows, highs, np.full(samples, 1e-8),
        inputs[:, None], np.zeros(2), np.array([0.1, 1.0]), estimates, samples,
    )  # fmt: skip


@pytest.fixture(scope="module")
def fast() -> Filter:
    """Return the filter, compiled: once for the tests of this file."""
    return cast("Filter", compiled(follow))


START = {"a_1": 0.5, "a_2": 2.6, "b_0": 1.2, "d": 0.0}
SISO = parse_linear("siso:2,0", ("y",), ("u",))


@pytest.mark.parametrize("flipped", [0.0, 0.04])
def test_when_a_plant_moves_then_its_signs_give_its_parameters(flipped: float, fast: Filter) -> None:
    found = identify_symbols(flight(40.0, flipped), SISO, 0.0, START, fast)
    assert found.refused == ()
    true = {"a_1": 0.8, "a_2": 2.0, "b_0": 1.5, "d": 0.0}
    for item in found.parameters:
        assert abs(item.value - true[item.name]) < 3.0 * item.deviation + 0.03
        assert item.deviation < 0.1
    assert 1e-4 < found.densities[0] < 2e-3  # 4e-4


def test_when_nothing_moves_the_plant_then_the_parameters_are_refused_by_name(fast: Filter) -> None:
    found = identify_symbols(flight(20.0, 0.0, moves=1e-3), SISO, 0.0, START, fast)
    assert any("b_0" in text and "uncertain" in text for text in found.refused)


def ordered(values: Array) -> bool:
    return bool(np.all(np.diff(values) > 0.0))


def test_when_the_estimates_are_drawn_then_they_begin_at_the_model_that_flew_and_end_at_the_last(
    fast: Filter,
) -> None:
    found = identify_symbols(flight(20.0, 0.0), SISO, 0.0, START, fast)
    history = found.regression.estimates[0].history
    assert ordered(found.regression.times_s)
    assert len(found.regression.times_s) == len(history) == len(found.regression.filtered_input)
    assert history[-1] == pytest.approx(list(found.values.values()), rel=0.01, abs=0.01)
    assert abs(history[0, 1] - START["a_2"]) < abs(history[0, 1] - found.values["a_2"])
