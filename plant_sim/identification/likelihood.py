"""The likelihood of a flight's symbols for a plant: a Gaussian filter that uses only them.

Every symbol says of one combination of the states, c' x plus a reading error, that it lies between two
numbers that both ends know; of a sign one of them is infinite. The state is taken as Gaussian. For a
Gaussian, the probability p of the symbol gives the best mean and covariance after it by its derivatives
along c' x alone:

    m <- m + P c dl,    P <- P + P c (ddl) c' P,    l = log p

and the sum of l is the logarithm of the likelihood. Between samples the mean follows the equations by
Runge-Kutta steps, and the covariance their derivatives.

Plain Python over arrays, so that it can be compiled as it stands.
"""

from __future__ import annotations

import math
from typing import Any

ROOT_HALF = math.sqrt(0.5)
ROOT_TAU = math.sqrt(2.0 * math.pi)
FAR = 38.0
"""standard deviations; the normal distribution ends there"""


def derivative(A: Any, sine: Any, drive: Any, x: Any, out: Any) -> None:
    """Write A x + drive, and to the second state -c sin(x1) + d cos(x1), with (c, d) in `sine`."""
    for i in range(len(x)):
        total = drive[i]
        for j in range(len(x)):
            total += A[i, j] * x[j]
        out[i] = total
    if sine[0] != 0.0 or sine[1] != 0.0:
        out[1] += sine[1] * math.cos(x[0]) - sine[0] * math.sin(x[0])


def transition(A: Any, step_s: float, out: Any, work: Any) -> None:
    """Write exp(A step_s), by the series to the fourth order."""
    n = len(A)
    for i in range(n):
        for j in range(n):
            out[i, j] = 1.0 if i == j else 0.0
    for order in range(4, 0, -1):
        for i in range(n):
            for j in range(n):
                total = 0.0
                for k in range(n):
                    total += A[i, k] * out[k, j]
                work[i, j] = total * step_s / order
        for i in range(n):
            for j in range(n):
                out[i, j] = work[i, j] + (1.0 if i == j else 0.0)


def predict(
    A: Any, sine: Any, drive: Any, noise: Any, step_s: float, x: Any, P: Any, work: Any
) -> None:
    """Carry mean and covariance over one step; `work` holds vectors first, then matrices."""
    n = len(x)
    J, F, M = work[3], work[4], work[5]
    total, rate, moved = work[0, 0], work[1, 0], work[2, 0]
    swings = sine[0] != 0.0 or sine[1] != 0.0
    if swings:
        for i in range(n):
            for j in range(n):
                J[i, j] = A[i, j]
        J[1, 0] -= sine[0] * math.cos(x[0]) + sine[1] * math.sin(x[0])
        transition(J, step_s, F, M)
    for i in range(n):
        moved[i] = x[i]
        total[i] = 0.0
    for stage in range(4):
        derivative(A, sine, drive, moved, rate)
        for i in range(n):
            total[i] += rate[i] * (1.0 if stage == 0 or stage == 3 else 2.0)
            moved[i] = x[i] + rate[i] * step_s * (1.0 if stage == 2 else 0.5)
    for i in range(n):
        x[i] += total[i] * step_s / 6.0
    for i in range(n):
        for j in range(n):
            value = 0.0
            for k in range(n):
                value += F[i, k] * P[k, j]
            M[i, j] = value
    for i in range(n):
        for j in range(i + 1):
            value = noise[i, j]
            for k in range(n):
                value += M[i, k] * F[j, k]
            P[i, j] = value
            P[j, i] = value


def between(low: float, high: float) -> float:
    """Return the probability that a standard normal number lies between two others."""
    if low > 0.0:
        return 0.5 * (math.erfc(low * ROOT_HALF) - math.erfc(high * ROOT_HALF))
    return 0.5 * (math.erfc(-high * ROOT_HALF) - math.erfc(-low * ROOT_HALF))


def density(z: float) -> float:
    """Return the standard normal density, 0 where it is nothing."""
    return math.exp(-0.5 * z * z) / ROOT_TAU if -FAR < z < FAR else 0.0


def update(
    c: Any, low: float, high: float, spread: float, wrong: float, x: Any, P: Any, v: Any
) -> float:
    """Take c' x to be between `low` and `high`; return the log-likelihood of that.

    `wrong` is the share of symbols that say nothing.
    """
    n = len(x)
    mean, variance = 0.0, spread
    for i in range(n):
        mean += c[i] * x[i]
        total = 0.0
        for j in range(n):
            total += P[i, j] * c[j]
        v[i] = total
    for i in range(n):
        variance += c[i] * v[i]
    deviation = math.sqrt(variance)
    a, b = (low - mean) / deviation, (high - mean) / deviation
    left, right = density(a), density(b)
    p = 0.5 * wrong + (1.0 - wrong) * between(a, b)
    first = (1.0 - wrong) * (left - right) / p
    bent = (a * left if left > 0.0 else 0.0) - (b * right if right > 0.0 else 0.0)
    second = (1.0 - wrong) * bent / p - first * first
    for i in range(n):
        x[i] += v[i] * first / deviation
        for j in range(n):
            P[i, j] += v[i] * v[j] * second / variance
    return math.log(p)


def follow(
    A: Any,
    sine: Any,
    drive: Any,
    noise: Any,
    step_s: float,
    firsts: Any,
    combinations: Any,
    lows: Any,
    highs: Any,
    spreads: Any,
    wrong: float,
    x: Any,
    P: Any,
    work: Any,
    logs: Any,
    means: Any,
) -> None:
    """Write each sample's log-likelihood, and the mean state after its symbols.

    `drive` has a row for each step; symbols `firsts[k] ... firsts[k + 1] - 1` are those of sample k.
    """
    samples = len(firsts) - 1
    steps = len(drive) // samples
    transition(A, step_s, work[4], work[5])
    for k in range(samples):
        total = 0.0
        for e in range(firsts[k], firsts[k + 1]):
            c, v = combinations[e], work[0, 0]
            total += update(c, lows[e], highs[e], spreads[e], wrong, x, P, v)
        logs[k] = total
        for i in range(len(x)):
            means[k, i] = x[i]
        for step in range(k * steps, (k + 1) * steps):
            predict(A, sine, drive[step], noise, step_s, x, P, work)
