"""The constants of the coders `direction` and `learning`, found once from a plant and a rate.

The cost of an error is not only its present cost: an error of the rate becomes one of the angle. N is
that cost-to-go under the coder itself, which asks for the direction that N calls the most expensive. So
it is found by turns, from an ideal code's (the floor's multipliers) or from that of a few samples
without bits: fly the covariance forward under N, bring the cost of its errors back, take N between the
two. Of all N, the one under which the mean error is least is kept.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from channel.codec.coders.direction import SQUARINGS, DirectionParameters
from channel.codec.coders.learning import LearningParameters
from plant_sim.zero_order_hold import discretised, van_loan
from tenbaud.bounds.floor import ideal_worth, period_cost, require_rate
from tenbaud.bounds.linear import Matrix, rate_needed, sampled
from tenbaud.design.plant import LinearPlant, rows_of

ROUNDS = 25
SAMPLES = 600
AHEAD = 8
"""samples that first guesses of N look ahead at most"""
GROWN = 4
"""samples that the first P has grown for"""
GAIN_LEAST, PATIENCE = 1e-4, 3
"""relative gain of a round; the search ends after more than this number of rounds that gain less"""
WORTH_MAX = 1e9
"""of an error of the usual size, in units of the floor"""


class Turn(NamedTuple):
    """A covariance flown forward, and the cost of its errors brought back."""

    cost: float
    worth: Matrix
    covariance: Matrix


def design_direction(
    plant: LinearPlant, rate_bit_s: float, symbol_period_s: float, *, adapts: bool = True
) -> DirectionParameters:
    """Return the coder's constants for a plant at a rate; ValueError if there is no such coder.

    A word of `rate_bit_s symbol_period_s` bits leaves every symbol period.
    """
    bits = round(rate_bit_s * symbol_period_s)
    if bits < 1 or abs(bits - rate_bit_s * symbol_period_s) > 1e-6 * bits:
        raise ValueError(
            f"{rate_bit_s:g} bit/s make {rate_bit_s * symbol_period_s:g} bits in a symbol period of "
            f"{symbol_period_s:g} s; a word has a whole number of them"
        )
    needed = require_rate(plant.A, rate_bit_s)
    model = plant.model()
    covariance, ideal = ideal_worth(model, rate_bit_s)
    sizes = np.sqrt(np.diag(covariance))
    transition, noise = sampled(model, symbol_period_s)
    cost, _ = period_cost(model, symbol_period_s)
    products = np.outer(sizes, sizes)
    used = needed / rate_bit_s
    alpha = max(0.67, 0.58 + 0.18 * used)
    # On a plant that grows, steps are larger than the best ones: smaller ones lose it now and then.
    kappa = min(max(0.75 + 0.75 * used, 1.15), 1.25) if needed > 0.0 else 1.0
    scaled = (transition * sizes / sizes[:, None], noise / products, cost * products, ideal * products)
    with np.errstate(all="ignore"):
        best = _search(tuple(one.tobytes() for one in scaled), alpha, bits)
    return DirectionParameters(
        transition=rows_of(transition),
        noise=rows_of(noise),
        worth=rows_of(best.worth / products),
        start=rows_of(best.covariance * products),
        bits=bits,
        adapts=adapts,
        removed=alpha,
        step=kappa,
    )


def design_learning(
    plant: LinearPlant, rate_bit_s: float, symbol_period_s: float
) -> LearningParameters:
    """Return what the coder `learning` needs, but for what it learns; see `design_direction`.

    ValueError for a plant that grows: near its smallest rate what is learned goes astray there, and the
    plant is lost.
    """
    found = design_direction(plant, rate_bit_s, symbol_period_s)
    needed = rate_needed(plant.A)
    if needed > 0.0:
        raise ValueError(
            f"the plant grows (smallest rate {needed:.4g} bit/s), and its terms are not learned there: "
            "use the coder `direction`, and leave model.learns out"
        )
    noises = [
        van_loan(plant.A, density * np.outer(column, column), symbol_period_s)[1]
        for column, density in zip(plant.G.T, plant.densities, strict=True)
        if density > 0.0
    ]
    F, N = np.array(found.transition), np.array(found.worth)
    share = 1.0 - math.sqrt(1.0 - found.removed)
    parts = [np.zeros_like(F) for _ in noises]
    for sample in range(SAMPLES):
        parts = [_symmetric(F @ part @ F.T + noise) for part, noise in zip(parts, noises, strict=True)]
        for _ in range(found.bits if GROWN <= sample < SAMPLES - 1 else 0):
            c, v = _direction(N, np.sum(parts, axis=0))
            left = np.eye(len(F)) - share * np.outer(v, c)
            parts = [_symmetric(left @ part @ left.T) for part in parts]
    return LearningParameters(
        transition=found.transition,
        noises=tuple(rows_of(_symmetric(noise)) for noise in noises),
        worth=found.worth,
        starts=tuple(rows_of(part) for part in parts),
        reach=rows_of(discretised(plant.A, np.eye(len(F)), symbol_period_s)[1]),
        spreads=(),
        bits=found.bits,
        removed=found.removed,
        step=found.step,
    )


@lru_cache(maxsize=64)
def _search(matrices: tuple[bytes, ...], alpha: float, bits: int) -> Turn:
    """Search once for each plant and rate: many flights of one ask for the same."""
    size = math.isqrt(len(matrices[0]) // 8)
    F, Q, M, ideal = (np.frombuffer(one).reshape(size, size) for one in matrices)
    covariance = Q
    for _ in range(GROWN):
        covariance = _symmetric(F @ covariance @ F.T + Q)
    guesses = [ideal, M]
    moved = F
    for _ in range(AHEAD):
        guesses.append(guesses[-1] + moved.T @ M @ moved)
        moved = moved @ F
    best = Turn(math.inf, M, covariance)
    for guess in map(_symmetric, guesses):
        turn = _turn(F, Q, M, guess, covariance, alpha, bits)
        if turn.cost < best.cost:
            best = Turn(turn.cost, guess, turn.covariance)
    if not math.isfinite(best.cost):
        raise ValueError("no direction coder was found: the rate is too near to the smallest one")
    worth, covariance = best.worth, best.covariance
    idle = 0
    for _ in range(ROUNDS):
        turn = _turn(F, Q, M, worth, covariance, alpha, bits)
        idle = idle + 1 if turn.cost > best.cost * (1.0 - GAIN_LEAST) else 0
        if turn.cost < best.cost:
            best = Turn(turn.cost, worth, turn.covariance)
        # Where one mode is corrected too seldom, the cost of an error grows without bound.
        if idle > PATIENCE or not float(np.abs(turn.worth).max()) < WORTH_MAX:
            break
        worth = _symmetric(0.5 * (worth + turn.worth))
        covariance = turn.covariance
    return best


def _turn(
    F: Matrix, Q: Matrix, M: Matrix, N: Matrix, covariance: Matrix, alpha: float, bits: int
) -> Turn:
    """Fly `SAMPLES` bits forward from a covariance, and the cost of an error back from N.

    The cost is not finite where the covariance grew without bound.
    """
    P = covariance
    flown = []
    cost = 0.0
    for bit in range(SAMPLES):
        c, v = _direction(N, P)
        flown.append((c, v))
        P = P - (alpha * v)[:, None] * v
        if (bit + 1) % bits == 0:
            if bit >= SAMPLES // 3:
                cost += float((M * P).sum())
            P = _symmetric(F @ P @ F.T + Q)
    ahead = N
    total = np.zeros_like(N)
    for bit in range(SAMPLES - 1, -1, -1):
        c, v = flown[bit]
        now = M + F.T @ ahead @ F if (bit + 1) % bits == 0 else ahead
        if SAMPLES // 3 <= bit < 2 * SAMPLES // 3:
            total = total + now
        known = now @ v
        # alpha (v' known) c c' - alpha (c known' + known c')
        half = 0.5 * alpha * float(v @ known) * c - alpha * known
        both = c[:, None] * half
        ahead = now + both + both.T
    return Turn(cost * bits / (SAMPLES - SAMPLES // 3), total / (SAMPLES // 3), P)


def _direction(N: Matrix, P: Matrix) -> tuple[Matrix, Matrix]:
    """Return c and v as the coder finds them; without a number where P is no covariance any more."""
    power = N @ P
    power = power / power.trace()
    for _ in range(SQUARINGS):
        power = power @ power
    c = power[:, power.diagonal().argmax()]
    v = P @ c
    scale = 1.0 / np.sqrt(c @ v)
    return c * scale, v * scale


def _symmetric(matrix: Matrix) -> Matrix:
    return 0.5 * (matrix + matrix.T)
