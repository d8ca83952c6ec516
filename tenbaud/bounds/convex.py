"""The convex problem behind the floor, solved by a barrier method with exact derivatives.

    minimise  tr(M P)   subject to   rate(P) <= r  (nat),   K(P) >= 0,   P > 0

over symmetric matrices P of a few rows. `K` is affine, `rate` convex (Tanaka, Kim, Parrilo and Mitter,
IEEE TAC 62, 2017, have both). The logarithmic barrier's minimum for a weight t is within
`(2 n + 1) / t` of the optimum, which is how the accuracy is known.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol

import numpy as np

from tenbaud.bounds.linear import Matrix

ACCURACY = 1e-10
WEIGHT_GROWTH = 12.0
NEWTON_STEPS_MAX = 80
DECREMENT = 1e-14
QUADRATIC = 1e-2
"""decrement below which full steps converge; the value is too coarse to choose a length by"""
HALVINGS_MAX = 60


class Value(NamedTuple):
    """A scalar function of P with its derivatives along the basis."""

    value: float
    gradient: Matrix
    hessian: Matrix


class Problem(Protocol):
    """Rate and affine constraint of one kind of channel."""

    cost: Matrix
    """M"""

    def rate(self, covariance: Matrix, basis: Matrix) -> Value:
        """Return the rate in nat that holds the covariance, and its derivatives."""

    def slack(self, covariance: Matrix) -> Matrix:
        """Return K(P)."""

    def slack_basis(self, basis: Matrix) -> Matrix:
        """Return the derivative of K along each basis matrix."""


def symmetric_basis(size: int) -> Matrix:
    """Return the matrices that span the symmetric ones, stacked."""
    basis = []
    for row in range(size):
        for column in range(row + 1):
            one = np.zeros((size, size))
            one[row, column] = one[column, row] = 1.0
            basis.append(one)
    return np.array(basis)


def traces(left: Matrix, right: Matrix) -> Matrix:
    """Return tr(L_i R_j) of two stacks of matrices."""
    return np.asarray(np.einsum("iab,jba->ij", left, right))


def log_determinant(matrix: Matrix, basis: Matrix) -> Value:
    """Return log det and its derivatives along the images of the basis; -inf when not positive."""
    try:
        diagonal = np.diag(np.linalg.cholesky(matrix))
        products = np.linalg.inv(matrix) @ basis
    except np.linalg.LinAlgError:
        return Value(-np.inf, np.zeros(len(basis)), np.zeros((len(basis), len(basis))))
    gradient = np.trace(products, axis1=1, axis2=2)
    return Value(2.0 * float(np.log(diagonal).sum()), gradient, -traces(products, products))


def minimise(problem: Problem, start: Matrix, rate_nats: float) -> Matrix:
    """Return the covariance of least cost that the rate can hold; `start` is strictly within."""
    basis = symmetric_basis(len(start))
    gradient = np.sum(problem.cost * basis, axis=(1, 2))
    barrier = _Barrier(problem, rate_nats, basis, problem.slack_basis(basis), gradient)
    point = start
    cost = float(np.sum(problem.cost * point))
    weight = 1.0 / cost
    while (2 * len(start) + 1) / weight > ACCURACY * cost:
        weight *= WEIGHT_GROWTH
        point = _centre(barrier, point, weight)
        cost = float(np.sum(problem.cost * point))
    return point


class _Barrier(NamedTuple):
    """`t tr(M P) - log(r - rate) - log det P - log det K`, infinite outside of the constraints."""

    problem: Problem
    rate_nats: float
    basis: Matrix
    images: Matrix
    cost_gradient: Matrix

    def at(self, point: Matrix, weight: float) -> Value:
        positive = log_determinant(point, self.basis)
        within = log_determinant(self.problem.slack(point), self.images)
        if not (np.isfinite(positive.value) and np.isfinite(within.value)):
            return Value(np.inf, positive.gradient, positive.hessian)
        rate = self.problem.rate(point, self.basis)
        left = self.rate_nats - rate.value
        if not left > 0.0:
            return Value(np.inf, positive.gradient, positive.hessian)
        value = weight * float(np.sum(self.problem.cost * point)) - float(np.log(left))
        return Value(
            value - positive.value - within.value,
            weight * self.cost_gradient + rate.gradient / left - positive.gradient - within.gradient,
            np.outer(rate.gradient, rate.gradient) / left**2
            + rate.hessian / left
            - positive.hessian
            - within.hessian,
        )


def _centre(barrier: _Barrier, point: Matrix, weight: float) -> Matrix:
    """Return the barrier's minimum for one weight: damped Newton steps."""
    here, before = barrier.at(point, weight), math.inf
    for _ in range(NEWTON_STEPS_MAX):
        if not np.isfinite(here.hessian).all():
            raise ValueError(
                "the floor cannot be computed: numbers of this plant at this rate overflow"
            )
        # Scaled to a unit diagonal, so that directions of very different curvature all count.
        sizes = np.sqrt(np.diag(here.hessian))
        scaled = here.hessian / np.outer(sizes, sizes)
        step = -np.linalg.lstsq(scaled, here.gradient / sizes, rcond=None)[0] / sizes
        decrement = -float(here.gradient @ step)
        if decrement < DECREMENT:
            return point
        direction = np.tensordot(step, barrier.basis, 1)
        if decrement < QUADRATIC:
            if decrement > 0.25 * before:
                return point
            before = decrement
            there = point + direction
            after = barrier.at(there, weight)
            if not np.isfinite(after.value):
                return point
            point, here = there, after
            continue
        length = 1.0
        for _ in range(HALVINGS_MAX):
            there = point + length * direction
            after = barrier.at(there, weight)
            if after.value <= here.value - 0.1 * length * decrement:
                break
            length *= 0.5
        else:
            return point
        point, here = there, after
    return point
