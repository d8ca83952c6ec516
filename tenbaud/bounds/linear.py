"""Linear models driven by white noise, and the smallest rate at which they can be followed."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plant_sim.zero_order_hold import van_loan

Matrix: TypeAlias = NDArray[np.float64]

RANK_TOLERANCE = 1e-9


@dataclass(frozen=True, slots=True)
class LinearModel:
    """`dx = A x dt + dw`, `E dw dw' = Q dt`, of which the outputs `C x` are to be known.

    States that no noise reaches do not belong in it: both ends know them from the commands.
    """

    dynamics: Matrix
    """A, 1/s"""
    noise: Matrix
    """Q, two-sided spectral density"""
    cost: Matrix
    """W, the weight of an error: `C' diag(w) C` for outputs of weights w"""

    @property
    def states(self) -> int:
        return len(self.cost)


def linear_model(
    dynamics: ArrayLike, noise: ArrayLike, outputs: ArrayLike, weights: ArrayLike | None = None
) -> LinearModel:
    """Return a checked model; ValueError says what is wrong with it.

    `outputs` is C, or the one row of it; `weights` are those of the squared output errors, 1 without.
    Every state must be driven by the noise and seen in an output of some weight: otherwise the floor is
    that of a smaller model, and which one is for the caller to say (`reached`).
    """
    a = np.atleast_2d(np.asarray(dynamics, dtype=float))
    q = np.atleast_2d(np.asarray(noise, dtype=float))
    c = np.atleast_2d(np.asarray(outputs, dtype=float))
    w = np.ones(len(c)) if weights is None else np.atleast_1d(np.asarray(weights, dtype=float))
    states = c.shape[1]
    if a.shape != (states, states) or q.shape != (states, states):
        raise ValueError(
            f"an output has {states} entries, so dynamics and noise must be {states} x {states}; "
            f"they are {a.shape} and {q.shape}"
        )
    if w.shape != (len(c),) or not (w >= 0.0).all():
        raise ValueError(f"weights are one for each of the {len(c)} outputs, at least 0; got {w}")
    if not all(np.isfinite(one).all() for one in (a, q, c, w)):
        raise ValueError("the model has an entry that is not finite")
    if not np.allclose(q, q.T) or np.linalg.eigvalsh(q).min() < -1e-12 * max(1.0, np.abs(q).max()):
        raise ValueError("the noise density must be symmetric and not negative")
    if _rank_of_powers(a, q) < states:
        raise ValueError(
            "the noise does not reach every state: leave out those it does not, both ends know them"
        )
    if _rank_of_powers(a.T, c.T * w) < states:
        raise ValueError(
            "the output does not see every state (the pair is not observable): no rate bounds a state "
            "that never shows; leave it out, or choose an output that sees it"
        )
    return LinearModel(a, q, c.T * w @ c)


def reached(
    dynamics: Matrix, noise: Matrix, outputs: Matrix, weights: Matrix
) -> tuple[LinearModel, Matrix]:
    """Return the part of a plant that the noise reaches, and its basis: x = basis z.

    The rest is known to both ends from the commands. ValueError where the outputs do not show it all,
    or the noise reaches nothing.
    """
    if not np.any(noise):
        raise ValueError(
            "no disturbance reaches the plant (its densities, or G, are all 0), so both ends know all "
            "of it from the commands: no rate is needed, and no error is the least"
        )
    powers = _powers(dynamics, noise)
    left, sizes, _ = np.linalg.svd(powers)
    rank = int(np.count_nonzero(sizes > RANK_TOLERANCE * max(1.0, float(sizes[0]))))
    basis = np.eye(len(dynamics)) if rank == len(dynamics) else left[:, :rank]
    model = linear_model(basis.T @ dynamics @ basis, basis.T @ noise @ basis, outputs @ basis, weights)
    return model, basis


def _rank_of_powers(a: Matrix, columns: Matrix) -> int:
    return int(np.linalg.matrix_rank(_powers(a, columns), tol=RANK_TOLERANCE))


def _powers(a: Matrix, columns: Matrix) -> Matrix:
    """Return [B, AB, A^2 B, ...], each block scaled so that a fast A does not hide it."""
    block = columns / (np.abs(columns).max() or 1.0)
    blocks = [block]
    speed = np.abs(a).max() or 1.0
    for _ in range(len(a) - 1):
        block = a @ block / speed
        blocks.append(block)
    return np.hstack(blocks)


def unreached(
    dynamics: ArrayLike, columns: ArrayLike, least: float = 0.0, growth: float = -math.inf
) -> tuple[complex, int] | None:
    """Return a motion of `dynamics` that `columns` do not reach: its eigenvalue, and its largest state.

    None where they reach every motion whose eigenvalue is `least` or larger, and its real part above
    `growth` (Popov, Belevitch and Hautus). Of the transposed matrices: a motion that the outputs do not
    show.
    """
    a, b = (np.atleast_2d(np.asarray(one, dtype=float)) for one in (dynamics, columns))
    scale = max(1.0, float(np.abs(a).max()))
    b = b * (scale / (np.abs(b).max() or 1.0))
    for value in np.linalg.eigvals(a):
        if abs(value) < least or not value.real > growth:
            continue
        left, sizes, _ = np.linalg.svd(np.hstack([a - value * np.eye(len(a)), b]))
        if sizes[-1] < RANK_TOLERANCE * scale:
            return complex(value), int(np.argmax(np.abs(left[:, -1])))
    return None


def rate_needed(dynamics: ArrayLike) -> float:
    """Return the bit/s that a plant needs to be followed at all: the data-rate theorem.

    Sum of `Re lambda / ln 2` over the eigenvalues in the right half plane (Nair and Evans, SIAM J.
    Control Optim. 43, 2004; Tatikonda and Mitter, IEEE TAC 49, 2004). Below it the error grows without
    bound, whatever the code; the rate must be *above* it.
    """
    a = np.atleast_2d(np.asarray(dynamics, dtype=float))
    growth = np.linalg.eigvals(a).real
    # A defective zero eigenvalue, as of a chain of integrators, is found with an error of about
    # eps^(1/n); it is no growth.
    slack = 1e-7 * max(1.0, float(np.abs(a).max()))
    return float(growth[growth > slack].sum()) / math.log(2.0)


def sampled(model: LinearModel, period_s: float) -> tuple[Matrix, Matrix]:
    """Return transition matrix and noise covariance over a period."""
    return van_loan(model.dynamics, model.noise, period_s)
