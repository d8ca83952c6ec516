"""One sign at a time, in the direction of the state space with the most costly error.

Both ends propagate a covariance P of the receiver's error, from the plant's F and Q and from the
symbols. N is the cost of an error, now and later. For each bit, with shared numbers alone:

1. `P <- P + gamma max(m, 0)^3 D D'`: long runs of agreeing signs mean that P is too small along D.
2. The direction c: the eigenvector of `N P` with the largest eigenvalue, scaled to `c' P c = 1`, found
   as a column of `(N P)^16`; `v = P c`.
3. The transmitter sends `s = sign(c' (x - x_hat))`.
4. `d = c' D`, `z = s d / sqrt(d^2 + delta)`, `m <- m + mu (z - m)`: does the sign agree with what a
   larger disturbance would have said?
5. The correction is `sigma kappa (1 + tau z) s v`.
6. `P <- P - alpha v v'`, `D <- D - a d v + kappa s v`.
7. `sigma <- sigma (1 + k (z + beta) + eta max(m, 0)^3)` within its limits.

Once a sample then, erased or not, `P <- F P F' + Q` and `D <- F D`. P and D are in units of sigma, the
strength of the disturbance in units of the assumed one; D is how the estimate depends on log sigma.
With k and eta zero the strength is taken as known.

alpha would be 2/pi and kappa sqrt(2/pi) for the sign of a normal error. The comparisons (largest
entry, positive part) are of shared numbers, which are equal to the last bit.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from channel.codec.codec import Alphabet, Vector
from channel.codec.coders.base import (
    CoderFunctions,
    FunctionCoder,
    Numbers,
    Results,
    SymbolResults,
    Symbols,
)
from channel.codec.coders.symmetric import (
    check_symmetric,
    deviations,
    most_correlated,
    place,
    write_full,
)
from channel.codec.models.linear import Rows, check, flat

SQUARINGS = 4
GROWTH_MAX = 1e12
"""P is held within this many times what it starts from, however long nothing arrives."""


@dataclass(frozen=True, slots=True)
class DirectionParameters:
    """Parameters; the matrices are those of the corrected states, for one sample."""

    transition: Rows
    """F"""
    noise: Rows
    """Q"""
    worth: Rows
    """N"""
    start: Rows
    """P before the first word"""
    bits: int = 1
    """signs per sample"""
    adapts: bool = True
    """follow a disturbance of unknown strength; False: it is as Q says"""
    removed: float = 0.67
    """alpha"""
    step: float = 1.0
    """kappa"""
    initial_strength: float = 1.0
    minimum_strength: float = 1e-3
    maximum_strength: float = 1e3
    """sigma"""


class DirectionConstants(NamedTuple):
    """Constants of the functions below; matrices row by row."""

    transition: Vector
    noise: Vector
    worth: Vector
    largest: Vector
    """per state: the variance that P is held within"""
    alpha: float
    kappa: float
    smallest_strength: float
    largest_strength: float
    k: float
    eta: float
    gamma: float = 0.35
    mu: float = 0.4
    a: float = 0.8
    delta: float = 0.003
    tau: float = 0.04
    beta: float = 0.15


def size_of(constants: DirectionConstants) -> int:
    """Return how many states are corrected."""
    return len(constants.largest)


def aim(constants: DirectionConstants, coder: Results, c: Results, v: Results) -> bool:
    """Step 1 and 2: let P grow, write the direction and what is known along it.

    `coder` is P (lower half), D, m, sigma. Return whether there is a direction: not when P is zero.
    """
    n = size_of(constants)
    first = n * (n + 1) // 2  # integers
    run = coder[first + n]
    if run > 0.0:
        growth = constants.gamma * (run * run * run)
        for i in range(n):
            for j in range(i + 1):
                coder[place(i, j)] += growth * (coder[first + i] * coder[first + j])
    return point(constants.worth, coder, c, v)


def point(worth: Numbers, known: Numbers, c: Results, v: Results) -> bool:
    """Write the direction that N calls the most expensive under a P, and v = P c.

    `known` begins with the lower half of P. Return whether there is a direction.
    """
    n = len(c)
    power = [0.0] * (n * n)
    square = [0.0] * (n * n)
    write_full(known, n, square)
    for i in range(n):
        for j in range(n):
            total = 0.0
            for k in range(n):
                total += worth[i * n + k] * square[k * n + j]
            power[i * n + j] = total
    for _ in range(SQUARINGS):
        trace = 0.0
        for i in range(n):
            trace += power[i * n + i]
        if not trace > 0.0:
            return False
        scale = 1.0 / (trace * trace)
        for i in range(n):
            row = i * n
            for j in range(n):
                total = 0.0
                at = j
                for k in range(n):
                    total += power[row + k] * power[at]
                    at += n
                square[row + j] = total * scale
        power, square = square, power
    best = 0
    for i in range(1, n):
        if power[i * n + i] > power[best * n + best]:
            best = i
    for i in range(n):
        c[i] = power[i * n + best]
    variance = 0.0
    for i in range(n):
        total = 0.0
        for j in range(n):
            total += known[place(i, j)] * c[j]
        v[i] = total
        variance += c[i] * total
    if not variance > 0.0:
        return False
    scale = 1.0 / math.sqrt(variance)
    for i in range(n):
        c[i] *= scale
        v[i] *= scale
    return True


def learn(
    constants: DirectionConstants,
    coder: Results,
    c: Numbers,
    v: Numbers,
    sign: int,
    correction: Results,
) -> None:
    """Steps 4 to 7: add the correction that a sign means, and write what is known after it."""
    n = size_of(constants)
    first = n * (n + 1) // 2  # integers
    strength = coder[first + n + 1]
    d = 0.0
    for i in range(n):
        d += c[i] * coder[first + i]
    agrees = sign * d / math.sqrt(d * d + constants.delta)
    run = coder[first + n] + constants.mu * (agrees - coder[first + n])
    size = strength * constants.kappa * (1.0 + constants.tau * agrees) * sign
    shift = constants.kappa * sign - constants.a * d
    for i in range(n):
        correction[i] += size * v[i]
        for j in range(i + 1):
            coder[place(i, j)] -= constants.alpha * (v[i] * v[j])
        coder[first + i] += shift * v[i]
    positive = run if run > 0.0 else 0.0
    change = constants.k * (agrees + constants.beta) + constants.eta * (positive * positive * positive)
    strength = strength * (1.0 + change)
    if strength < constants.smallest_strength:
        strength = constants.smallest_strength
    if strength > constants.largest_strength:
        strength = constants.largest_strength
    coder[first + n] = run
    coder[first + n + 1] = strength


def wait(constants: DirectionConstants, coder: Results) -> None:
    """Let P and D grow over a sample, within the limits of P."""
    n = size_of(constants)
    first = n * (n + 1) // 2  # integers
    transition, noise = constants.transition, constants.noise
    full = [0.0] * (n * n)
    moved = [0.0] * (n * n)
    turned = [0.0] * n
    write_full(coder, n, full)
    for i in range(n):
        total = 0.0
        for j in range(n):
            total += transition[i * n + j] * coder[first + j]
            product = 0.0
            for k in range(n):
                product += transition[i * n + k] * full[k * n + j]
            moved[i * n + j] = product
        turned[i] = total
    excess = 1.0
    at = 0
    for i in range(n):
        for j in range(i + 1):
            total = noise[i * n + j]
            for k in range(n):
                total += moved[i * n + k] * transition[j * n + k]
            coder[at] = total
            at += 1
        variance = coder[at - 1]
        if variance > excess * constants.largest[i]:
            excess = variance / constants.largest[i]
    shrink = 1.0 / math.sqrt(excess)
    for i in range(n):
        coder[first + i] = turned[i] * shrink
    if excess > 1.0:
        for i in range(first):
            coder[i] = coder[i] / excess


def direction_encode(
    constants: DirectionConstants,
    coder: Numbers,
    predicted: Numbers,
    measurement: Numbers,
    symbols: SymbolResults,
) -> None:
    """Write the signs of the errors along the directions asked for; vectors are of corrected states."""
    n = size_of(constants)
    own = [0.0] * len(coder)
    for i in range(len(coder)):
        own[i] = coder[i]
    c = [0.0] * n
    v = [0.0] * n
    correction = [0.0] * n
    for bit in range(len(symbols)):
        symbols[bit] = 1
        if aim(constants, own, c, v):
            error = 0.0
            for i in range(n):
                error += c[i] * (measurement[i] - predicted[i] - correction[i])
            if error < 0.0:
                symbols[bit] = -1
            learn(constants, own, c, v, symbols[bit], correction)


def direction_decode(
    constants: DirectionConstants,
    coder: Numbers,
    model: Numbers,
    symbols: Symbols,
    erased: bool,
    correction: Results,
    after: Results,
) -> None:
    """Write the correction of the corrected states and the coder state at the next sample."""
    n = size_of(constants)
    for i in range(len(after)):
        after[i] = coder[i]
    for i in range(n):
        correction[i] = 0.0
    if not erased:
        c = [0.0] * n
        v = [0.0] * n
        for bit in range(len(symbols)):
            if aim(constants, after, c, v):
                learn(constants, after, c, v, symbols[bit], correction)
    wait(constants, after)


class DirectionCoder(FunctionCoder):
    """One or more signs per sample for all corrected states together.

    Coder state: the lower half of P, D, m (mean agreement of the last signs) and sigma. `readout` has a
    row for each output, how much of each corrected state is in it; none: each of them is an output. It
    serves what is shown to people.
    """

    functions = CoderFunctions(direction_encode, direction_decode, allocates=True)
    impulse = True
    uses_rates = True

    def __init__(self, parameters: DirectionParameters, readout: Rows = ()) -> None:
        p = parameters
        size = len(p.transition)
        self.readout = readout or [[0.0 + (row == at) for at in range(size)] for row in range(size)]
        for name in ("transition", "noise", "worth", "start"):
            check(name, getattr(p, name), size, size)
        check_parameters(p)
        self.parameters = p
        self.alphabet = Alphabet((-1, 1), p.bits)
        self.correction_size = size
        self.constants = DirectionConstants(
            flat(p.transition),
            flat(p.noise),
            flat(p.worth),
            tuple(GROWTH_MAX * p.start[state][state] for state in range(size)),
            p.removed,
            p.step,
            p.minimum_strength,
            p.maximum_strength,
            0.01 if p.adapts else 0.0,
            0.03 if p.adapts else 0.0,
        )

    def initial(self) -> Vector:
        """Return the state of both ends before the first word."""
        start = self.parameters.start
        lower = [start[row][column] for row in range(len(start)) for column in range(row + 1)]
        nothing = [0.0] * (self.correction_size + 1)
        return (*lower, *nothing, self.parameters.initial_strength)

    def is_state(self, coder: Vector) -> bool:
        """Return whether the variances are within their limits, and the strength within its own."""
        within = self.parameters.minimum_strength <= coder[-1] <= self.parameters.maximum_strength
        largest = self.constants.largest
        return within and all(
            0.0 <= coder[place(state, state)] <= 2.0 * limit for state, limit in enumerate(largest)
        )

    def about(self, coder: Vector, word: Sequence[int], correction: Numbers) -> tuple[int, ...]:
        """Return, for each sign, the output whose error correlates most with what was asked."""
        if len(self.readout) == 1:
            return (0,) * len(word)
        if len(word) == 1:  # along v
            return (most_correlated(self.readout, coder, correction),)
        known = list(coder)
        c, v, correction = ([0.0] * self.correction_size for _ in range(3))
        found = []
        for at, sign in enumerate(word):
            is_asked = aim(self.constants, known, c, v)
            found.append(most_correlated(self.readout, known, v) if is_asked else 0)
            if is_asked and at + 1 < len(word):
                learn(self.constants, known, c, v, sign, correction)
        return tuple(found)

    def ranges(self, coder: Vector) -> Vector:
        """Return, for each output, the standard deviation that both ends assume."""
        return deviations(self.readout, coder, coder[-1])


def check_parameters(parameters: DirectionParameters) -> None:
    """Raise ValueError where the parameters make no coder."""
    p = parameters
    check_steps(p.bits, p.removed, p.minimum_strength, p.initial_strength, p.maximum_strength)
    for name in ("noise", "worth", "start"):
        rows = getattr(parameters, name)
        check_symmetric(name, rows)
        for row in range(len(rows)):
            if name == "start" and not rows[row][row] > 0.0:
                raise ValueError(f"start must be above 0 on its diagonal, state {row + 1} is not")


def check_steps(bits: int, removed: float, smallest: float, initial: float, largest: float) -> None:
    """Raise ValueError for a word, a share of the variance or strengths that make no coder."""
    if not 1 <= bits <= 15:
        raise ValueError(f"bits must be 1 ... 15, got {bits}")
    if not 0.0 < removed < 1.0:
        raise ValueError(f"removed must be above 0 and below 1, got {removed}")
    if not 0.0 < smallest <= initial <= largest:
        raise ValueError(
            f"strengths must be 0 < minimum <= initial <= maximum, got {smallest}, {initial}, {largest}"
        )
