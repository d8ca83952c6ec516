"""The least errors of a plant at a rate: the figures of `tenbaud floor`."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tenbaud.bounds.floor import floor_covariance, word_floor
from tenbaud.bounds.linear import rate_needed, reached
from tenbaud.design.plant import LinearPlant


@dataclass(frozen=True, slots=True)
class Floors:
    """The least errors at a rate; none where it is too low for the plant."""

    rate_bit_s: float
    rate_needed_bit_s: float
    """more than this is needed by the data-rate theorem"""
    rms: tuple[float, ...] | None
    """per output, together the least by their weights, for bits that flow all the time"""
    weighted_rms: float | None
    """root of the weighted sum of their squares"""
    words_over_flow: float | None
    """by how much that root is larger when the bits come one word per symbol period"""


def floors(plant: LinearPlant, rate_bit_s: float, symbol_period_s: float | None = None) -> Floors:
    """Return the floors of a plant at a rate; with a symbol period, those of its words too.

    States that no disturbance reaches are known to both ends from the commands. ValueError where the
    outputs do not show all that is disturbed.
    """
    needed = rate_needed(plant.A)
    if not rate_bit_s > needed:
        return Floors(rate_bit_s, needed, None, None, None)
    model, basis = reached(plant.A, plant.noise, plant.C, plant.weights)
    covariance = floor_covariance(model, rate_bit_s)
    seen = plant.C @ basis
    squares = np.einsum("ij,jk,ik->i", seen, covariance, seen)
    least = float(plant.weights @ squares)
    over = None
    if symbol_period_s is not None:
        words = word_floor(model, rate_bit_s * symbol_period_s, symbol_period_s)
        over = math.sqrt(words / least)
    rms = tuple(float(value) for value in np.sqrt(squares))
    return Floors(rate_bit_s, needed, rms, math.sqrt(least), over)
