"""The floor: the least mean square error that R bit/s allow, for any causal code.

For a linear model under white noise, an estimate that rests on R bit/s without any information in
*when* the bits come has a steady covariance P with

    tr A + 1/2 tr(Q P^-1) <= R ln 2,     A P + P A' + Q >= 0

(Duncan, SIAM J. Appl. Math. 19, 1970, with the sequential rate-distortion problem of Tanaka et al.).
The least `tr(W P)` under these is the floor; `closed.py` has the two cases with a closed form.
A controller that hears no more than these bits cannot track better either: its error is the sum of the
estimation error and something that does not correlate with it.

With `b` bits at a time, one word per period T, the error is the mean over the period:

    1/2 log det(F P F' + Q_T) - 1/2 log det P <= b ln 2,     P <= F P F' + Q_T
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import lru_cache

import numpy as np
import scipy

from tenbaud.bounds.closed import LN2
from tenbaud.bounds.convex import Value, log_determinant, minimise, traces
from tenbaud.bounds.linear import LinearModel, Matrix, rate_needed, sampled

QUADRATURE_POINTS = 12
SCALINGS = 2
STARTING = (0.25, 0.75)
"""of what the rate has above the smallest: where the search for a floor may start"""
STARTS_MAX = 300


class RateTooLow(ValueError):
    """A rate at which no code can follow the plant; the text says which one can."""


def floor(model: LinearModel, rate_bit_s: float) -> float:
    """Return the least mean square error at R bit/s: that of the outputs, by their weights.

    Where a share of the bits is lost, and known by both ends to be lost, R is the rate of the others:
    the capacity of the erasure channel with feedback.
    """
    return float(np.sum(model.cost * floor_covariance(model, rate_bit_s)))


def floor_covariance(model: LinearModel, rate_bit_s: float) -> Matrix:
    """Return the covariance P of the errors whose weighted mean square is least."""
    matrices = (np.asarray(one, float) for one in (model.dynamics, model.noise, model.cost))
    _check_rate(model, rate_bit_s)
    return _floor_covariance(tuple(one.tobytes() for one in matrices), rate_bit_s).copy()


@lru_cache(maxsize=64)
def _floor_covariance(matrices: tuple[bytes, ...], rate_bit_s: float) -> Matrix:
    """Solve for it once: all flights of a plant ask for the same, which takes longer than they do."""
    states = math.isqrt(len(matrices[0]) // 8)
    model = LinearModel(*(np.frombuffer(one).reshape(states, states) for one in matrices))
    scaled, covariance = _solved(model, rate_bit_s)
    return scaled.back(covariance)


def _solved(model: LinearModel, rate_bit_s: float) -> tuple[_Scaled, Matrix]:
    """Return the scaled model, and its covariance at the floor."""
    scaled = _Scaled(model, rate_bit_s)
    nats = scaled.rate_nats
    return scaled, minimise(_Flow(scaled.model), _start(scaled.model, nats), nats)


def ideal_worth(model: LinearModel, rate_bit_s: float) -> tuple[Matrix, Matrix]:
    """Return (P, N): the floor's covariance, and the cost of an error for an ideal code, now and later.

    With the multipliers lambda of the rate and Z of `K = A P + P A' + Q >= 0`, which fulfil
    `W = lambda/2 P^-1 Q P^-1 + A' Z + Z A`, it is `N = lambda/2 P^-1 - Z`: bits go where the eigenvalue
    of `N P` is largest, lambda/2, and no reduction of any other error is worth its bits.
    """
    scaled, covariance = _solved(model, rate_bit_s)
    one = scaled.model
    inverse = np.linalg.inv(covariance)
    # The barrier's Z is a multiple of K^-1.
    slack = np.linalg.inv(_Flow(one).slack(covariance))
    paid = 0.5 * inverse @ one.noise @ inverse
    spared = one.dynamics.T @ slack + slack @ one.dynamics
    columns = np.stack([paid.ravel(), spared.ravel()], axis=1)
    (price, share), *_ = np.linalg.lstsq(columns, one.cost.ravel(), rcond=None)
    worth = (0.5 * price * inverse - share * slack) * scaled.unit / scaled.speed
    return scaled.back(covariance), worth / np.outer(scaled.sizes, scaled.sizes)


def word_floor(model: LinearModel, bits: float, period_s: float) -> float:
    """Return the least mean square error, over time, with a word of `bits` bits every `period_s`.

    The word is there at the instant of its sample.
    """
    _check_rate(model, bits / period_s)
    scaled = _Scaled(model, bits / period_s)
    period = scaled.speed * period_s
    problem = _Words(scaled.model, period)
    nats = scaled.rate_nats * period
    covariance = minimise(problem, problem.start(nats), nats)
    return scaled.unit * (float(np.sum(problem.cost * covariance)) + problem.between)


def _check_rate(model: LinearModel, rate_bit_s: float) -> None:
    """Raise ValueError for what is no rate, RateTooLow for one that cannot hold the plant."""
    if not (math.isfinite(rate_bit_s) and rate_bit_s > 0.0):
        raise ValueError(f"the rate is {rate_bit_s} bit/s; it must be above 0")
    require_rate(model.dynamics, rate_bit_s)


def require_rate(
    dynamics: Matrix,
    rate_bit_s: float,
    *,
    states: Sequence[str] = (),
    advice: str = "",
) -> float:
    """Return the smallest rate of a plant; RateTooLow, with both numbers, for one that is not above.

    With the names of the `states` its text says which of them grows fastest; `advice` ends it.
    """
    needed = rate_needed(dynamics)
    if not rate_bit_s > needed:
        fastest = ""
        if states:
            values, vectors = np.linalg.eig(dynamics)
            place = int(np.argmax(values.real))
            name = states[int(np.argmax(np.abs(vectors[:, place])))]
            fastest = f", {name} fastest by {values[place].real:.4g} 1/s"
        raise RateTooLow(
            f"{rate_bit_s:.4g} bit/s are too few: this plant grows by itself{fastest}, and the "
            f"data-rate theorem asks for more than {needed:.4g} bit/s{advice}"
        )
    return needed


class _Scaled:
    """The model per `1 / speed` instead of per second, each state in units of its usual error.

    So matrices are well conditioned at any rate, whatever the states are counted in.
    """

    def __init__(self, model: LinearModel, rate_bit_s: float) -> None:
        self.speed = max(rate_bit_s, float(np.abs(np.linalg.eigvals(model.dynamics)).max()))
        self.rate_nats = rate_bit_s / self.speed * LN2
        self.sizes = np.ones(model.states)
        for _ in range(SCALINGS):
            self.sizes *= np.sqrt(np.diag(_start(self._of(model, 1.0), self.rate_nats)))
        self.unit = float(np.sum(model.cost * np.outer(self.sizes, self.sizes)))
        """of the scaled model's mean square error"""
        self.model = self._of(model, self.unit)

    def _of(self, model: LinearModel, unit: float) -> LinearModel:
        products = np.outer(self.sizes, self.sizes)
        dynamics = model.dynamics * self.sizes / self.sizes[:, None] / self.speed
        return LinearModel(dynamics, model.noise / products / self.speed, model.cost * products / unit)

    def back(self, covariance: Matrix) -> Matrix:
        """Return a covariance in the model's own units."""
        return covariance * np.outer(self.sizes, self.sizes)


def _start(model: LinearModel, rate_nats: float) -> Matrix:
    """Return a covariance strictly within the constraints: that of seeing every state equally well.

    `A P + P A' + Q = k^2 P P` has the rate `k^2 tr P / 2`, which rises with k from the data-rate
    theorem's to any.
    """
    identity = np.eye(model.states)

    def at(log_gain: float) -> tuple[float, Matrix]:
        seen = identity * math.exp(log_gain)
        found = scipy.linalg.solve_continuous_are(model.dynamics.T, seen, model.noise, identity)
        return 0.5 * math.exp(2.0 * log_gain) * float(np.trace(found)), np.asarray(found)

    guess = 0.5 * math.log(2.0 * rate_nats / model.states)
    return _between(at, rate_needed(model.dynamics) * LN2, rate_nats, guess)


def _between(
    at: Callable[[float], tuple[float, Matrix]], least: float, most: float, log_gain: float
) -> Matrix:
    """Return the covariance at a gain whose rate is well between two; the rate rises with the gain."""
    step = 1.0
    for _ in range(STARTS_MAX):
        rate, covariance = at(log_gain)
        share = (rate - least) / (most - least)
        if STARTING[0] < share < STARTING[1]:
            return 0.5 * (covariance + covariance.T)
        # Smaller steps once the rate has been passed.
        step = step if (share < STARTING[0]) == (step > 0.0) else -0.5 * step
        log_gain += step
    raise ValueError("the floor cannot be computed: no filter of this plant is near this rate")


class _Flow:
    """Bits that flow all the time."""

    def __init__(self, model: LinearModel) -> None:
        self.model = model
        self.cost = model.cost

    def rate(self, covariance: Matrix, basis: Matrix) -> Value:
        a, q = self.model.dynamics, self.model.noise
        inverse = np.linalg.inv(covariance)
        weighted = inverse @ q @ inverse
        value = float(np.trace(a)) + 0.5 * float(np.sum(q * inverse))
        gradient = -0.5 * np.sum(weighted * basis, axis=(1, 2))
        hessian = traces(weighted @ basis, inverse @ basis)
        return Value(value, gradient, 0.5 * (hessian + hessian.T))

    def slack(self, covariance: Matrix) -> Matrix:
        product = self.model.dynamics @ covariance
        return np.asarray(product + product.T + self.model.noise)

    def slack_basis(self, basis: Matrix) -> Matrix:
        products = self.model.dynamics @ basis
        return np.asarray(products + products.transpose(0, 2, 1))


def period_cost(model: LinearModel, period_s: float) -> tuple[Matrix, float]:
    """Return M and m: an error e at a period's beginning costs `e' M e + m` in the mean over it."""
    cost = np.zeros_like(model.noise)
    between = 0.0
    nodes, weights = np.polynomial.legendre.leggauss(QUADRATURE_POINTS)
    for node, weight in zip(nodes, weights, strict=True):
        transition, noise = sampled(model, 0.5 * (node + 1.0) * period_s)
        cost += 0.5 * weight * transition.T @ model.cost @ transition
        between += 0.5 * weight * float(np.sum(model.cost * noise))
    return cost, between


class _Words:
    """A word per period; P is the covariance just after it."""

    def __init__(self, model: LinearModel, period_s: float) -> None:
        self.model = model
        self.transition, self.noise = sampled(model, period_s)
        cost, between = period_cost(model, period_s)
        self.cost = cost
        self.between = between
        """what grows within a period whatever the words say"""

    def start(self, rate_nats: float) -> Matrix:
        """Return a covariance strictly within: that of a filter that sees every state equally well."""
        identity, unit = np.eye(self.model.states), math.sqrt(float(np.trace(self.noise)))
        basis = np.zeros((0, *self.noise.shape))

        def at(log_gain: float) -> tuple[float, Matrix]:
            seen = identity * math.exp(log_gain) / unit
            ahead = scipy.linalg.solve_discrete_are(self.transition.T, seen, self.noise, identity)
            found: Matrix = np.asarray(np.linalg.solve(identity + seen @ seen @ ahead, ahead), float)
            return self.rate(found, basis).value, found

        return _between(at, max(0.0, _growth_nats(self.transition)), rate_nats, 0.0)

    def rate(self, covariance: Matrix, basis: Matrix) -> Value:
        images = self.transition @ basis @ self.transition.T
        ahead = log_determinant(self.transition @ covariance @ self.transition.T + self.noise, images)
        now = log_determinant(covariance, basis)
        return Value(
            0.5 * (ahead.value - now.value),
            0.5 * (ahead.gradient - now.gradient),
            0.5 * (ahead.hessian - now.hessian),
        )

    def slack(self, covariance: Matrix) -> Matrix:
        return np.asarray(self.transition @ covariance @ self.transition.T + self.noise - covariance)

    def slack_basis(self, basis: Matrix) -> Matrix:
        return np.asarray(self.transition @ basis @ self.transition.T - basis)


def _growth_nats(transition: Matrix) -> float:
    sizes = np.abs(np.linalg.eigvals(transition))
    return float(np.log(sizes[sizes > 1.0]).sum())
