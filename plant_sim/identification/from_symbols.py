"""Identification from a flight's symbols: the parameters for which they are most likely.

Around the maximum the log-likelihood is a parabola, so that the sum of the scores' outer products is
the information, and its inverse the covariance; what the first samples alone would have said follows
from the sums up to them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from plant_sim.identification.estimator import Estimate, condition_of
from plant_sim.identification.filters import Array
from plant_sim.identification.maximum import Maximum, climb
from plant_sim.identification.pipeline import Identification, doubts, uncertain
from plant_sim.identification.regression import Filters, Regression, constants_of
from plant_sim.identification.structures import PitchStructure, Structure, names_of
from plant_sim.identification.symbols import Likelihood, Symbols, likelihood

GUESSED = -math.log(2.0)
"""log-likelihood of a symbol of two values that nothing is known of"""
DENSITIES = range(6, -28, -2)
"""logarithms of the disturbances tried first, in units of what moves the plant by its first range"""
WIDER = (3.0, 0.0, 6.0, 1.5)
"""starts above the likeliest of them: much disturbance makes a smooth likelihood"""
SAME = 0.5
"""of the log-likelihood; two starts that reach it have found the maximum"""
LOG_STEP = 2.0
"""of a logarithm in a round of the search"""
WRONG = math.log(1e-3)
"""logarithm of the share of symbols that say nothing, at first"""
WEAK = 1e-6
"""share of all information that the model that flew has in the history"""
HISTORY = 500
"""rows of the estimates' history"""
REGIONS = 0.3
"""of a parameter, or of what it could explain at most: by which it moves in a round"""


class Levels(NamedTuple):
    """Root mean squares along the estimated motion."""

    terms: dict[str, float]
    """of what each parameter multiplies"""
    targets: tuple[float, ...]
    """of each equation's highest derivative"""


def identify_symbols(
    symbols: Symbols,
    structure: Structure,
    lag_s: float,
    start: Mapping[str, float],
    function: Callable[..., None],
) -> Identification:
    """Identify a structure; `start` has the parameters of the model that flew.

    `function` is `follow`, compiled: plain Python takes minutes.
    """
    chance = likelihood(symbols, structure, lag_s, start, function)
    scale = _scale(chance, levels_of(chance, dict(start), symbols.estimates), start)
    flown, found = _highest(chance, np.array(list(start.values())), scale)
    notes = []
    values, covariance = _estimate(found, structure)
    spread = math.sqrt(max(0.0, covariance[0, 0]))
    if isinstance(structure, PitchStructure) and -3.0 * spread < values.get("a_w", 0.0) < 0.0:
        notes.append(
            f"a_w = {values['a_w']:.2g} +- {spread:.2g} is 0 within its uncertainty: held at 0"
        )
        structure = replace(structure, damped=False)
        chance = replace(chance, structure=structure)
        found = climb(chance, found.point[1:], scale[1:])
        values, covariance = _estimate(found, structure)
    levels = levels_of(chance, values, found.means)
    regression = _history(chance, found, levels, start)
    count = symbols.arrived
    notes.append(
        f"log-likelihood of a symbol {found.log / count:.3f}; with the model that flew "
        f"{flown / count:.3f}, of guesses {GUESSED:.3f}"
    )
    densities = np.exp(found.point[len(values) : -1]).tolist()
    result = Identification(
        structure, regression, None, lag_s, 0.0, values, covariance, False, tuple(notes), (), (),
        tuple(densities),
    )  # fmt: skip
    refused = tuple(_unsupported(result, found, chance.drives.shape[1]))
    return replace(result, warnings=tuple(doubts(result)), refused=refused)


def levels_of(chance: Likelihood, values: Mapping[str, float], states: Array) -> Levels:
    """Return what each term and each equation came to along a motion, given sample by sample."""
    structure, order = chance.structure, chance.structure.order
    outputs = states[:, ::order]
    signals = structure.signals(outputs)
    acting = chance.drives.reshape(len(states), chance.steps, -1).mean(axis=1)
    columns = np.hstack((signals, acting, np.ones((len(states), 1))))
    terms, targets = {}, []
    for equation in structure.equations:
        total = np.zeros(len(states))
        for term in equation.terms:
            column = columns[:, term.signal]
            if term.derivative:
                column = states[:, term.signal * order + term.derivative]
            terms[term.name] = float(np.sqrt(np.mean(column**2)))
            total += term.sign * values.get(term.name, 0.0) * column
        targets.append(float(np.sqrt(np.mean(total**2))))
    return Levels(terms, tuple(targets))


def _scale(chance: Likelihood, levels: Levels, start: Mapping[str, float]) -> Array:
    found = []
    for equation, target in zip(chance.structure.equations, levels.targets, strict=True):
        for term in equation.terms:
            most = target / max(levels.terms[term.name], 1e-12)
            found.append(REGIONS * max(abs(start[term.name]), 0.3 * most, 1e-9))
    return np.array(found + [LOG_STEP] * (len(chance.structure.equations) + 1))


def _highest(chance: Likelihood, start: Array, scale: Array) -> tuple[float, Maximum]:
    """Return the log-likelihood of the model that flew and the maximum, from several starts."""
    symbols, order = chance.symbols, chance.structure.order
    unit = symbols.start_deviations[::order] ** 2 / symbols.period_s ** (2 * order - 1)
    points = {log: np.concatenate((start, np.log(unit) + log, [WRONG])) for log in DENSITIES}
    logs = {log: float(chance(point)[0].sum()) for log, point in points.items()}
    likeliest = max(logs, key=logs.__getitem__)
    ends: list[Maximum] = []
    for wider in WIDER:
        point = points[likeliest].copy()
        point[len(start) : -1] += wider
        ends.append(climb(chance, point, scale))
        best = max(one.log for one in ends)
        if sum(best - one.log < SAME for one in ends) > 1:
            break
    return logs[likeliest], max(ends, key=lambda one: one.log)


def _estimate(found: Maximum, structure: Structure) -> tuple[dict[str, float], Array]:
    """Return the parameters and their covariance, infinite where the symbols say nothing of one."""
    names = names_of(structure)
    values = dict(zip(names, found.point[: len(names)].tolist(), strict=True))
    return values, _parameters_covariance(found.information, len(names))


def _parameters_covariance(information: Array, count: int) -> Array:
    """Return the covariance of the first parameters, whatever the others are."""
    own = information[:count, :count]
    others = information[count:, count:]
    # A disturbance that is as good as none has no score at all.
    kept = np.diag(others) > 1e-9
    across = information[:count, count:][:, kept]
    own = own - across @ np.linalg.solve(others[np.ix_(kept, kept)], across.T) if kept.any() else own
    if condition_of(own) < 1e-12:
        return np.diag(np.full(count, math.inf))
    return np.asarray(np.linalg.inv(own))


def _history(
    chance: Likelihood, found: Maximum, levels: Levels, start: Mapping[str, float]
) -> Regression:
    """Return the estimates as they came about: from the model that flew to the last."""
    structure, symbols = chance.structure, chance.symbols
    names = names_of(structure)
    count = len(names)
    scores, last = found.scores[:, :count], found.point[:count]
    before = np.array([start[name] for name in names])
    weak = np.diag(np.diag(found.information)[:count]) * WEAK
    sums, pulled = np.zeros((count, count)), np.zeros(count)
    ends = np.unique(np.linspace(0, len(scores), HISTORY + 1).astype(int))
    history = np.empty((len(ends) - 1, count))
    for row in range(len(history)):
        more = scores[ends[row] : ends[row + 1]]
        sums, pulled = sums + more.T @ more, pulled + more.sum(axis=0)
        aim = sums @ last + pulled + weak @ before
        history[row] = np.linalg.lstsq(sums + weak, aim, rcond=None)[0]
    covariance = _parameters_covariance(found.information, count)
    estimates, first = [], 0
    for equation, target in zip(structure.equations, levels.targets, strict=True):
        own = slice(first, first + len(equation.terms))
        constants = constants_of(structure, equation, chance.drives.shape[1])
        estimates.append(
            Estimate(
                history[:, own],
                last[own],
                covariance[own, own],
                np.array([levels.terms[term.name] for term in equation.terms]),
                condition_of(found.information[own, own], constants),
                0.0,
                target,
            )
        )
        first += len(equation.terms)
    filters = Filters(lag_s=chance.lag_s, forgetting_per_s=0.0, gain=None, rests=False)
    shown = chance.drives[:: chance.steps, 0][ends[1:] - 1]
    return Regression(structure, filters, tuple(estimates), ends[1:] * symbols.period_s, shown)


def _unsupported(found: Identification, maximum: Maximum, inputs: int) -> Iterable[str]:
    """Yield why the symbols support no model."""
    if not maximum.converged:
        yield "the search for the most likely parameters did not converge: fly longer"
    yield from uncertain(found, inputs)
    if isinstance(found.structure, PitchStructure) and found.values.get("a_w", 0.0) < 0.0:
        yield (
            f"a_w = {found.values['a_w']:.4g} is negative: a body that gains energy by itself; do the "
            "commands act later than they are due?"
        )
