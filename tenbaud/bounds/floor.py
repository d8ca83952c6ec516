"""The floor: the least mean square error that R bit/s allow, for any causal code.

For a linear model under white noise, an estimate that rests on R bit/s without any information in
*when* the bits come has a steady covariance P with

    tr A + 1/2 tr(Q P^-1) <= R ln 2,     A P + P A' + Q >= 0

(Duncan, SIAM J. Appl. Math. 19, 1970, with the sequential rate-distortion problem of Tanaka et al.).
The least `c' P c` under these is the floor; `closed.py` has the two cases with a closed form.
A controller that hears no more than these bits cannot track better either: its error is the sum of the
estimation error and something that does not correlate with it.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.linalg import solve_continuous_are
from scipy.optimize import brentq

from tenbaud.bounds.closed import LN2
from tenbaud.bounds.convex import Value, minimise, traces
from tenbaud.bounds.linear import LinearModel, Matrix, rate_needed


class RateTooLow(ValueError):
    """A rate at which no code can follow the plant; the text says which one can."""


def floor(model: LinearModel, rate_bit_s: float, erased: float = 0.0) -> float:
    """Return the least mean square error of the output at R bit/s, in its unit squared.

    `erased` is the fraction of the bits that are lost, and known by both ends to be lost: the floor is
    that of `(1 - erased) R`, the capacity of the erasure channel with feedback.
    """
    rate = paid_rate(model, rate_bit_s, erased)
    speed = pace_of(model, rate)
    one, unit = in_units_of(speed, model)
    nats = rate / speed * LN2
    covariance = minimise(_Flow(one), _start(one, nats), nats)
    return unit * float(one.output @ covariance @ one.output)


def paid_rate(model: LinearModel, rate_bit_s: float, erased: float) -> float:
    """Return the rate that arrives; RateTooLow where it cannot hold the plant."""
    if not (math.isfinite(rate_bit_s) and rate_bit_s > 0.0):
        raise ValueError(f"the rate is {rate_bit_s} bit/s; it must be above 0")
    if not 0.0 <= erased < 1.0:
        raise ValueError(f"the erased fraction is {erased}; it must be at least 0 and below 1")
    needed = rate_needed(model.dynamics)
    rate = rate_bit_s * (1.0 - erased)
    if rate <= needed:
        lost = f", of which {100.0 * erased:g} % are lost," if erased else ""
        raise RateTooLow(
            f"{rate_bit_s:g} bit/s{lost} are too few: this plant grows by itself, and the data-rate "
            f"theorem asks for more than {needed / (1.0 - erased):.4g} bit/s"
        )
    return rate


def pace_of(model: LinearModel, rate_bit_s: float) -> float:
    """Return what sets the pace, bits or plant, in 1/s."""
    return max(rate_bit_s, float(np.abs(np.linalg.eigvals(model.dynamics)).max()))


def in_units_of(speed: float, model: LinearModel) -> tuple[LinearModel, float]:
    """Return the model per `1 / speed` instead of per second, with noise of size one, and its unit.

    The unit is that of the squared error. State i is counted in units of speed^i, so that a chain of
    integrators has the same numbers at any rate and matrices stay well conditioned.
    """
    scale = speed ** np.arange(model.states, dtype=float)
    dynamics = model.dynamics * scale / scale[:, None] / speed
    noise = model.noise / np.outer(scale, scale) / speed
    size = float(np.trace(noise))
    return LinearModel(dynamics, noise / size, model.output * scale), size


def _start(model: LinearModel, rate_nats: float) -> Matrix:
    """Return a covariance strictly within the constraints: that of seeing every state equally well.

    `A P + P A' + Q = k^2 P P` has the rate `k^2 tr P / 2`, which rises with k from the data-rate
    theorem's to any.
    """
    identity = np.eye(model.states)
    wanted = 0.5 * (rate_nats + rate_needed(model.dynamics) * LN2)

    def covariance(log_gain: float) -> Matrix:
        seen = identity * math.exp(log_gain)
        found = solve_continuous_are(model.dynamics.T, seen, model.noise, identity)
        return np.asarray(0.5 * (found + found.T))

    def excess(log_gain: float) -> float:
        return 0.5 * math.exp(2.0 * log_gain) * float(np.trace(covariance(log_gain))) - wanted

    low = high = 0.0
    while excess(low) > 0.0:
        low -= 1.0
    while excess(high) < 0.0:
        high += 1.0
    return covariance(brentq(excess, low, high, xtol=1e-3))


class _Flow:
    """Bits that flow all the time."""

    def __init__(self, model: LinearModel) -> None:
        self.model = model
        self.cost: Matrix = np.outer(model.output, model.output)

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
