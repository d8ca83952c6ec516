"""The coder by itself on an exact plant: the error's own dynamics, white noise and signs, compiled.

There is no encoder, no observer and no loop: of an exact linear plant that is seen exactly the error is
all there is. It is compared with the floor of the same plant at the same rate.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial
from typing import Any, NamedTuple

import numpy as np

from channel.codec.coders.direction import DirectionCoder
from reproduction.limits.intervals import Ratio, mean_of
from tenbaud.bounds.floor import floor, period_cost
from tenbaud.bounds.linear import Matrix, sampled
from tenbaud.design.described import plant_of, plant_section
from tenbaud.design.direction import design_direction
from tenbaud.design.plant import LinearPlant
from tenbaud.studies.compiled import arrays_of, compiled

OUTPUTS = ("travel", "elevation", "pitch")
DENSITIES = {"unequal": (2e-6, 2e-6, 2e-3), "equal": (2e-3, 2e-3, 2e-3)}
"""q of travel, elevation and pitch, rad^2/s^3"""
RATES = (10.0, 20.0, 30.0)
SAMPLES, SETTLING = 12_000, 500
UNKNOWN = 3.0
"""amplitude of the disturbance over what a coder assumes that does not know it"""


class Row(NamedTuple):
    """One line of the table."""

    densities: str
    rate_bit_s: float
    known: Ratio
    """rms over the joint floor"""
    unknown: Ratio
    degrees: tuple[float, ...]
    """rms error of each output, the strength known"""
    least_degrees: float
    """floor, of all outputs together"""


def error_products(
    encode: Any, decode: Any, F: Any, root: Any, constants: Any, start: Any,
    samples: int, settling: int, seed: int,
) -> Any:  # fmt: skip
    """Return the mean of e e' just after the bits; `root` is that of the noise's covariance."""
    np.random.seed(seed)  # numba's generator
    n = len(F)
    error, zero, correction = np.zeros(n), np.zeros(n), np.zeros(n)
    coder, after = start.copy(), start.copy()
    word = np.zeros(1, dtype=np.int64)
    total = np.zeros((n, n))
    for sample in range(samples):
        encode(constants, coder, zero, error, word)
        decode(constants, coder, zero, word, False, correction, after)
        coder[:] = after
        error -= correction
        if sample >= settling:
            total += np.outer(error, error)
        error = F @ error + root @ np.random.standard_normal(n)
    return total / (samples - settling)


def root_of(covariance: Matrix) -> Matrix:
    """Return L with L L' = covariance, which may lack rank by rounding."""
    regular = covariance + 1e-13 * np.diag(np.diag(covariance))
    return np.asarray(np.linalg.cholesky(regular), dtype=np.float64)


def products_of(
    plant: LinearPlant, rate: float, coder: DirectionCoder, strength: float, seeds: range, samples: int
) -> list[Matrix]:
    """Return the mean of e e' after the bits for each seed, in units of the disturbance's strength."""
    flown = _flown()
    F, Q = (np.ascontiguousarray(one) for one in sampled(plant.model(), 1.0 / rate))
    fixed = (F, strength * root_of(Q), arrays_of(coder.constants), np.array(coder.initial()))
    return [flown(*fixed, samples, SETTLING, 1000 + seed) / strength**2 for seed in seeds]


@cache
def _flown() -> Callable[..., Matrix]:
    from numba import njit

    encode, decode, _ = DirectionCoder.functions
    made = njit(error_products)
    return partial(made, compiled(encode, allocates=True), compiled(decode, allocates=True))


def squares_of(plant: LinearPlant, rate: float, products: list[Matrix]) -> list[float]:
    """Return the mean square of the weighted error of each seed, the time between the bits included."""
    M, between = period_cost(plant.model(), 1.0 / rate)
    return [float(np.sum(M * one)) + between for one in products]


def helicopter(densities: tuple[float, ...]) -> LinearPlant:
    """Return the linear helicopter in hover."""
    section = plant_section("helicopter")
    plant = plant_of(section.model_copy(update={"densities": densities}), 0.01)
    assert plant is not None
    return plant


def row_of(name: str, rate: float, seeds: int, samples: int = SAMPLES) -> Row:
    """Return a line of the table."""
    densities = DENSITIES[name]
    plant = helicopter(densities)
    designed = design_direction(plant, rate, 1.0 / rate)
    steady = DirectionCoder(replace(designed, adapts=False))
    known = products_of(plant, rate, steady, 1.0, range(seeds), samples)
    unknown = products_of(plant, rate, DirectionCoder(designed), UNKNOWN, range(seeds), samples)
    least = floor(plant.model(), rate)
    degrees = []
    for place in range(len(OUTPUTS)):
        weights = tuple(float(place == one) for one in range(len(OUTPUTS)))
        M, between = _cost_of_one(plant, rate, weights)
        square = np.mean([np.sum(M * one) for one in known]) + between
        degrees.append(math.degrees(math.sqrt(square)))
    return Row(
        name,
        rate,
        ratios(squares_of(plant, rate, known), least),
        ratios(squares_of(plant, rate, unknown), least),
        tuple(degrees),
        math.degrees(math.sqrt(least)),
    )


def ratios(squares: list[float], least: float) -> Ratio:
    """Return the mean over the seeds of rms over the floor."""
    return mean_of([math.sqrt(one / least) for one in squares])


def _cost_of_one(plant: LinearPlant, rate: float, weights: tuple[float, ...]) -> tuple[Matrix, float]:
    """Return what `period_cost` does, for weights that need not show the whole plant."""
    model = replace(plant.model(), cost=plant.C.T * np.array(weights) @ plant.C)
    return period_cost(model, 1.0 / rate)
