"""A plant's linearisation; a linear plant's discretisation under a held command, and the inverse.

dx/dt = A x + B u   and   x[n+1] = F x[n] + E u[n]
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt
import scipy
from numpy.typing import ArrayLike

Matrix = npt.NDArray[np.float64]

IMAGINARY_MAX = 1e-9


def discretised(A: ArrayLike, B: ArrayLike, period_s: float) -> tuple[Matrix, Matrix]:
    """Return (F, E) of a period under a held command: zero-order hold."""
    a, b = (np.atleast_2d(np.asarray(one, dtype=float)) for one in (A, B))
    states, inputs = b.shape
    block = np.zeros((states + inputs, states + inputs))
    block[:states, :states] = a
    block[:states, states:] = b
    grown = scipy.linalg.expm(block * period_s)
    return grown[:states, :states], grown[:states, states:]


def continuous(F: ArrayLike, E: ArrayLike, period_s: float) -> tuple[Matrix, Matrix]:
    """Return (A, B) whose zero-order hold over a period is (F, E); ValueError where there is none."""
    f, e = (np.atleast_2d(np.asarray(one, dtype=float)) for one in (F, E))
    states, inputs = e.shape
    block = np.eye(states + inputs)
    block[:states, :states] = f
    block[:states, states:] = e
    grown = np.asarray(scipy.linalg.logm(block))
    if not np.isfinite(grown).all() or np.abs(grown.imag).max() > IMAGINARY_MAX:
        raise ValueError(
            f"F = {f.tolist()} is no zero-order hold of a continuous plant: it has an eigenvalue that "
            "is zero or on the negative real axis"
        )
    found = grown.real / period_s
    return found[:states, :states], found[:states, states:]


def van_loan(dynamics: Matrix, noise: Matrix, period_s: float) -> tuple[Matrix, Matrix]:
    """Return transition matrix and noise covariance over a period (Van Loan, IEEE TAC 23, 1978)."""
    states = len(dynamics)
    block = np.zeros((2 * states, 2 * states))
    block[:states, :states] = -dynamics
    block[:states, states:] = noise
    block[states:, states:] = dynamics.T
    exponential = scipy.linalg.expm(block * period_s)
    transition = exponential[states:, states:].T
    covariance = transition @ exponential[:states, states:]
    return transition, 0.5 * (covariance + covariance.T)


def differences(function: Callable[[Matrix], Matrix], at: Matrix, steps: Matrix) -> Matrix:
    """Return the derivatives of a vector by central differences, a column for each entry of `at`."""
    columns = []
    for index, step in enumerate(steps):
        moved = np.zeros_like(at)
        moved[index] = step
        columns.append((function(at + moved) - function(at - moved)) / (2.0 * step))
    return np.stack(columns, axis=1)
