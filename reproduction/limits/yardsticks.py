"""Floors that the page of limits compares with beside `tenbaud.bounds`: words, encoder, Wiener process.

With `b` bits at a time, one word per period T, the error is the mean over the period:

    1/2 log det(F P F' + Q_T) - 1/2 log det P <= b ln 2,     P <= F P F' + Q_T
"""

from __future__ import annotations

import math

import numpy as np
from scipy.linalg import expm
from scipy.optimize import brentq

from tenbaud.bounds.closed import DOUBLE_INTEGRATOR, LN2
from tenbaud.bounds.convex import Value, log_determinant, minimise
from tenbaud.bounds.floor import floor, in_units_of, pace_of, paid_rate
from tenbaud.bounds.linear import LinearModel, Matrix

WIENER = 1.0 / (2.0 * LN2)
"""0.721: mean square error of the Wiener process times R/q"""

QUADRATURE_POINTS = 12


def encoder_floor(counts_per_turn: int) -> float:
    """Return the rms of rounding to a count, in rad: its width over the root of 12."""
    if counts_per_turn < 1:
        raise ValueError(f"counts_per_turn is {counts_per_turn}; it must be at least 1")
    return math.tau / counts_per_turn / math.sqrt(12.0)


def double_integrator_rate_at_encoder_floor(density: float, counts_per_turn: int) -> float:
    """Return the bit/s at which an ideal code's error is as small as the encoder's rounding.

    For an angle under white torque: (0.890 q / (width^2 / 12))^(1/3).
    """
    width_squared = encoder_floor(counts_per_turn) ** 2
    return float((DOUBLE_INTEGRATOR * density / width_squared) ** (1.0 / 3.0))


def floor_behind_encoder(
    density: float, rate_bit_s: float, counts_per_turn: int, tick_s: float
) -> float:
    """Return the mean square floor, in rad^2, of an angle under white torque that an encoder reads.

    The encoder's rounding is taken for white noise of `width^2 / 12` at every tick. Who forms the bits
    then knows the Kalman filter's estimate and no more; the error is the filter's own, plus the floor
    of what the estimate does, which is the same plant driven by the innovations, `L r L'` (separation
    of estimation and coding: Wolf and Ziv, IEEE Trans. Inf. Theory 16, 1970). Rounding is not white
    noise; this is a yardstick, not a bound.
    """
    if not tick_s > 0.0:
        raise ValueError(f"tick_s is {tick_s}; it must be above 0")
    noise = encoder_floor(counts_per_turn) ** 2 * tick_s
    # Steady Kalman-Bucy filter of the double integrator: bandwidth (q / r)^(1/4).
    bandwidth = float((density / noise) ** 0.25)
    gain = np.array([math.sqrt(2.0) * bandwidth, bandwidth**2])
    own = math.sqrt(2.0) * bandwidth * noise
    driven = LinearModel(
        np.array([[0.0, 1.0], [0.0, 0.0]]), noise * np.outer(gain, gain), np.array([1.0, 0.0])
    )
    return own + floor(driven, rate_bit_s)


def word_floor(model: LinearModel, bits: float, period_s: float, erased: float = 0.0) -> float:
    """Return the least mean square error, over time, with a word of `bits` bits every `period_s`.

    The word is there at the instant of its sample. A word lost with probability `erased` counts for
    `1 - erased` of its bits.
    """
    rate = paid_rate(model, bits / period_s, erased)
    speed = pace_of(model, rate)
    one, unit = in_units_of(speed, model)
    problem = _Words(one, speed * period_s)
    nats = rate * period_s * LN2
    covariance = minimise(problem, problem.start(nats), nats)
    return unit * (float(np.trace(problem.cost @ covariance)) + problem.between)


class _Words:
    """A word per period; P is the covariance just after it."""

    def __init__(self, model: LinearModel, period_s: float) -> None:
        self.model = model
        self.transition, self.noise = sampled(model, period_s)
        cost = np.zeros_like(self.noise)
        between = 0.0
        nodes, weights = np.polynomial.legendre.leggauss(QUADRATURE_POINTS)
        for node, weight in zip(nodes, weights, strict=True):
            transition, noise = sampled(model, 0.5 * (node + 1.0) * period_s)
            seen = transition.T @ model.output
            cost += 0.5 * weight * np.outer(seen, seen)
            between += 0.5 * weight * float(model.output @ noise @ model.output)
        self.cost: Matrix = cost
        self.between = between
        """what grows within a period whatever the words say"""

    def start(self, rate_nats: float) -> Matrix:
        """Return a covariance strictly within: the limit of a filter that sees every state."""
        ahead = self.noise
        for _ in range(2):
            ahead = self.transition @ ahead @ self.transition.T + self.noise

        def settled(share: float) -> Matrix:
            # P = share (F P F' + Q) is a fixed point for a share that contracts; its rate is
            # -n/2 log share, all of the states' directions alike.
            covariance = ahead
            for _ in range(2000):
                following = share * (self.transition @ covariance @ self.transition.T + self.noise)
                if np.allclose(following, covariance, rtol=1e-12, atol=0.0):
                    break
                covariance = np.asarray(following)
            return covariance

        share = math.exp(-2.0 * 0.9 * rate_nats / self.model.states)
        radius = float(np.abs(np.linalg.eigvals(self.transition)).max())
        if share * radius**2 < 1.0 - 1e-6:
            return settled(share)
        return self._riccati_start(rate_nats)

    def _riccati_start(self, rate_nats: float) -> Matrix:
        """For plants that grow unevenly: bisect on how well every state is seen."""
        size = float(np.trace(self.noise))

        def after(gain: float) -> Matrix:
            covariance = self.noise
            for _ in range(5000):
                ahead = self.transition @ covariance @ self.transition.T + self.noise
                seen = np.linalg.inv(ahead) + gain / size * np.eye(len(ahead))
                following = np.asarray(np.linalg.inv(seen), dtype=np.float64)
                if np.allclose(following, covariance, rtol=1e-12, atol=0.0):
                    break
                covariance = following
            return 0.5 * (covariance + covariance.T)

        wanted = 0.5 * (rate_nats + max(0.0, _growth_nats(self.transition)))
        basis = np.zeros((0, *self.noise.shape))

        def excess(log_gain: float) -> float:
            return self.rate(after(math.exp(log_gain)), basis).value - wanted

        return after(math.exp(brentq(excess, -30.0, 30.0, xtol=1e-3)))

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


def sampled(model: LinearModel, period_s: float) -> tuple[Matrix, Matrix]:
    """Return transition matrix and noise covariance over a period (Van Loan, IEEE TAC 23, 1978)."""
    states = model.states
    block = np.zeros((2 * states, 2 * states))
    block[:states, :states] = -model.dynamics
    block[:states, states:] = model.noise
    block[states:, states:] = model.dynamics.T
    exponential = expm(block * period_s)
    transition = exponential[states:, states:].T
    covariance = transition @ exponential[:states, states:]
    return transition, 0.5 * (covariance + covariance.T)
