"""The least-squares estimator (9), (10), with the figures to judge its answer.

    Omega' = -Gamma phi phi' Omega + Gamma phi xi                                    (9)
    Gamma' = -Gamma phi phi' Gamma + alpha Gamma                                     (10)

(10) is the same as (Gamma^-1)' = phi phi' - alpha Gamma^-1, which over one step of length h has the
solution Gamma^-1 <- exp(-alpha h) Gamma^-1 + h phi phi'. That is recursive least squares with
forgetting. The sums of h phi phi' and h phi xi are taken over blocks of samples, of one sample each
unless the record is long.

When the excitation fades, (10) lets Gamma grow like exp(alpha t) without bound, and the first noise
afterwards throws the estimates away. Here alpha is scaled by 1 - |Gamma| / bound, so that Gamma stays
below the bound and the estimates rest where the data left them.

The uncertainty does not assume white noise, because the state filters colour it: the scores
phi (xi - phi' Omega) are summed over blocks longer than the filters remember, and the covariance is
Gamma (sum of blocks squared) Gamma.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from plant_sim.identification.errors import IdentificationError
from plant_sim.identification.filters import Array

BLOCKS_MAX = 20_000
"""blocks of a record at most: the length of the estimates' history"""

CONDITION_MIN = 1e-3
"""Smallest eigenvalue of the regressors' correlation matrix that still tells them apart; 1 would be
regressors without anything in common."""


@dataclass(frozen=True, slots=True, eq=False)
class Moments:
    """Sums over each block of samples, times the step."""

    block_s: float
    regressors: Array
    """(blocks, parameters, parameters): phi phi'"""
    products: Array
    """(blocks, parameters): phi xi"""
    targets: Array
    """(blocks,): xi^2"""


def moments_of(regressors: Array, targets: Array, step_s: float, block: int) -> Moments:
    """Return the sums over blocks of `block` samples; the last block may be shorter."""
    short = -len(regressors) % block
    if short:
        regressors = np.concatenate((regressors, np.zeros((short, regressors.shape[1]))))
        targets = np.concatenate((targets, np.zeros(short)))
    rows = regressors.reshape(-1, block, regressors.shape[1])
    turned = rows.transpose(0, 2, 1)
    aims = targets.reshape(-1, block)
    return Moments(
        block * step_s,
        step_s * (turned @ rows),
        step_s * (turned @ aims[:, :, None])[:, :, 0],
        step_s * (aims * aims).sum(axis=1),
    )


def joined(pieces: list[Moments]) -> Moments:
    """Return the blocks of several pieces of one record."""
    return Moments(
        pieces[0].block_s,
        np.concatenate([one.regressors for one in pieces]),
        np.concatenate([one.products for one in pieces]),
        np.concatenate([one.targets for one in pieces]),
    )


@dataclass(frozen=True, slots=True, eq=False)
class Estimate:
    """The estimates over time, and the last ones with their uncertainty."""

    history: Array
    """(blocks, parameters)"""
    values: Array
    covariance: Array
    """infinite while there are too few data"""
    levels: Array
    """root mean square of every regressor over the data still remembered"""
    condition: float
    """persistent-excitation measure: how far the regressors differ, 0 to 1"""
    residual: float
    """root mean square of xi - phi' Omega"""
    target: float
    """root mean square of xi"""


def estimate(
    moments: Moments,
    *,
    forgetting_per_s: float = 0.01,
    gain: float | None = 1e3,
    memory_s: float = 6.0,
    shown: int | None = None,
    constants: Sequence[int] = (),
) -> Estimate:
    """Run (9), (10) over all blocks.

    `forgetting_per_s` is alpha, `gain` the diagonal of Gamma(0) (None: large, by the size of each
    regressor); the norm of Gamma may not exceed ten times that of Gamma(0). `memory_s` is longer than
    the noise's memory. The first `shown` parameters count for the condition; the others describe how
    the record begins. `constants` are the regressors that are always 1: what they explain of the
    others does not tell them apart, and does not make them alike.
    """
    if not 0.0 <= forgetting_per_s < math.inf:
        raise IdentificationError(f"forgetting_per_s is {forgetting_per_s}; it must be at least 0")
    size = moments.regressors.shape[1]
    shown = size if shown is None else shown
    if gain is None:
        total = np.einsum("kii->i", moments.regressors)
        start = np.where(total > 0.0, total, 1.0) * 1e-9
    else:
        if not (math.isfinite(gain) and gain > 0.0):
            raise IdentificationError(f"gain is {gain}; it must be finite and above 0")
        start = np.full(size, 1.0 / gain)
    history, inverse, kept = _run(moments, start, forgetting_per_s)
    values = history[-1]
    weights = np.append(np.cumprod(kept[:0:-1])[::-1], 1.0)
    covariance = _covariance(moments, values, inverse, weights, memory_s)
    summed = np.einsum("k,kij->ij", weights, moments.regressors)
    remembered = float(weights.sum()) * moments.block_s
    levels = np.sqrt(np.diag(summed) / remembered)
    errors = (
        moments.targets
        - 2.0 * moments.products @ values
        + np.einsum("i,kij,j->k", values, moments.regressors, values)
    )
    return Estimate(
        history,
        values,
        covariance,
        levels,
        condition_of(summed[:shown, :shown] / remembered, constants),
        math.sqrt(max(0.0, float(weights @ errors)) / remembered),
        math.sqrt(float(weights @ moments.targets) / remembered),
    )


def _run(moments: Moments, start: Array, forgetting_per_s: float) -> tuple[Array, Array, Array]:
    """Return the estimates after each block, Gamma after the last, and what each leaves of the sums."""
    kept = np.ones(len(moments.products))
    if forgetting_per_s == 0.0:
        # The sums do not depend on Gamma then: all of them are inverted in one go.
        sums = np.cumsum(np.concatenate((np.diag(start)[None], moments.regressors)), axis=0)[1:]
        inverses = np.linalg.inv(sums)
        history = (inverses @ np.cumsum(moments.products, axis=0)[:, :, None])[:, :, 0]
        return history, inverses[-1], kept
    bound = 10.0 * float(np.sqrt(np.sum(start**-2.0)))
    information, product = np.diag(start), np.zeros(len(start))
    inverse, history = np.diag(1.0 / start), np.empty_like(moments.products)
    for index, (more, pulled) in enumerate(zip(moments.regressors, moments.products, strict=True)):
        share = max(0.0, 1.0 - math.sqrt(float((inverse * inverse).sum())) / bound)
        kept[index] = left = math.exp(-forgetting_per_s * share * moments.block_s)
        information = left * information + more
        product = left * product + pulled
        inverse = np.linalg.inv(information)
        history[index] = inverse @ product
    return history, inverse, kept


def _covariance(
    moments: Moments, values: Array, inverse: Array, weights: Array, memory_s: float
) -> Array:
    """Return Gamma (sum of blocks squared) Gamma, the blocks being longer than the noise's memory."""
    count = max(1, round(memory_s / moments.block_s))
    whole = len(weights) // count
    free = whole - len(values)
    if free < 1:
        return np.diag(np.full(len(values), math.inf))
    scores = moments.products - np.einsum("kij,j->ki", moments.regressors, values)
    edges = np.arange(0, whole * count, count)
    blocks = np.add.reduceat(weights[:, None] * scores, edges)
    # Few blocks flatter themselves: the estimate was fitted to the very errors they sum.
    return np.asarray(inverse @ (blocks.T @ blocks) @ inverse * (whole / free))


def condition_of(squares: Array, constants: Sequence[int] = ()) -> float:
    """Return the smallest eigenvalue of the correlation of regressors; 0 when one is missing.

    `squares` are their sums of products. What the constant ones explain of the others is left out.
    """
    shown = [place for place in range(len(squares)) if place not in constants]
    own = squares[np.ix_(shown, shown)]
    power = np.diag(own)
    if constants:
        across = squares[np.ix_(shown, constants)]
        own = own - across @ np.linalg.pinv(squares[np.ix_(constants, constants)]) @ across.T
    levels = np.sqrt(np.maximum(np.diag(own), 0.0))
    if not np.all(levels**2 > 1e-12 * np.maximum(power, 0.0)):
        return 0.0
    return float(max(0.0, np.linalg.eigvalsh(own / np.outer(levels, levels))[0]))
