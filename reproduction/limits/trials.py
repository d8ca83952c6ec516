"""Coders that were tried and not kept: what they reach on a double integrator, T and q in common units.

Thousands of bodies at once, exact states at the transmitter, no encoder. Each coder sends a word every
T and is charged what the fixed grid charges: a word of two bits takes two slots, a symbol of three
kinds `log2 3` bits. Constants were found by a search over the same simulation.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tenbaud.bounds.closed import DOUBLE_INTEGRATOR
from tenbaud.bounds.linear import Matrix

SETTLE_STEPS = 100

Quantise = Callable[[Matrix], Matrix]


@dataclass(frozen=True, slots=True)
class Trial:
    """A fixed-gain coder: a few levels of one combination of angle and rate."""

    name: str
    bits: float
    """what a word is charged"""
    quantise: Quantise
    aim: float
    angle: float
    rate: float


def _sign(value: Matrix) -> Matrix:
    return np.where(value >= 0.0, 1.0, -1.0)


def _three(threshold: float) -> Quantise:
    return lambda value: np.where(np.abs(value) < threshold, 0.0, _sign(value))


def _four(threshold: float, outer: float) -> Quantise:
    return lambda value: np.where(np.abs(value) < threshold, 1.0, outer) * _sign(value)


TRIALS = (
    Trial("sign, one bit", 1.0, _sign, 1.4626, 1.3811, 1.4703),
    Trial("two signs and a silence that is paid", math.log2(3.0), _three(1.340), 0.922, 1.032, 1.841),
    Trial("words of two bits", 2.0, _four(1.811, 3.378), 0.844, 0.375, 0.559),
)


def fly_trial(trial: Trial, bodies: int = 2000, steps: int = 600, seed: int = 5) -> float:
    """Return the rms over the floor of the trial's own rate, mean over time."""
    rng = np.random.default_rng(seed)
    angle = np.zeros(bodies)
    rate = np.zeros(bodies)
    total = 0.0
    for step in range(steps):
        level = trial.quantise(angle + trial.aim * rate)
        angle = angle - trial.angle * level
        rate = rate - trial.rate * level
        if step >= SETTLE_STEPS:
            total += float(np.mean(angle**2 + angle * rate + rate**2 / 3.0)) + 1.0 / 12.0
        first, second = rng.standard_normal((2, bodies))
        angle = angle + rate + 0.5 * first + second / math.sqrt(12.0)
        rate = rate + first
    mean = total / (steps - SETTLE_STEPS)
    # T = 1 and q = 1, so the rate is the bits of a word.
    return math.sqrt(mean * trial.bits**3 / DOUBLE_INTEGRATOR)
