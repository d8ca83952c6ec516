"""Signs as in the coder `direction`, from which both ends also learn the plant's terms.

The model's states x are followed by theta, the errors of its terms: each adds theta_i y_i to the
acceleration (or whatever rate) of one state, y_i being the term's value, and the model carries its mean
over the last samples. What both ends cannot know is held in parts, P = sum P_j of (x, theta): one for
each column of the disturbance, with a strength sigma_j of its own absorbed, and the last for theta. For
each bit:

1. c as `direction` finds it from the part of P that belongs to x; v_j = P_j (c; 0), v = sum v_j,
   w_j = c' v_j, which sum to 1. The sign is s = sign(c' (x - x_hat)).
2. d_j = c' D_j, z_j = s d_j / sqrt(d_j^2 + delta), D_j <- D_j - a d_j v_x + kappa s (2 v_j - w_j v_x).
3. The correction of (x, theta) is kappa (1 + tau sum w_j z_j) s v, theta kept within +-`learned_max`.
4. P_j <- (I - g v c') P_j (I - g v c')', g = 1 - sqrt(1 - alpha).
5. m_j <- m_j + mu w_j (z_j - m_j), P_j,xx <- P_j,xx + gamma w_j max(m_j, 0)^3 D_j D_j'.
6. With I_j = w_j (k (z_j + beta) + eta max(m_j, 0)^3): sigma_j and D_j are multiplied by
   1 + .4 I_j + .6 sum I, and P_j,xx by its square.

Once a sample then P_j <- [F, Y; 0, I] P_j [F, Y; 0, I]' + sigma_j^2 Q_j and D_j <- F D_j, where
column i of Y is y_i times what a constant rate of the term's state adds in a sample. The part of theta
grows by a little, so that what is known of it never becomes too certain to change.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from channel.codec.codec import Vector
from channel.codec.coders.base import Numbers, Results, SymbolResults, Symbols
from channel.codec.coders.direction import point
from channel.codec.coders.symmetric import place

SHARED = 0.6
"""share of a change of strength that all columns take, so that none that starts too small starves"""


class LearningConstants(NamedTuple):
    """Constants of the functions below; matrices row by row, those of columns one after another."""

    transition: Vector
    noises: Vector
    worth: Vector
    reach: Vector
    """a row per state, a column for each state that has terms"""
    largest: Vector
    """per corrected state: the variance that P is held within"""
    drifts: Vector
    """variance that each learned parameter gains in a sample"""
    rows: tuple[int, ...]
    """per learned parameter: column of `reach`"""
    learned_at: int
    """place of theta among the model's states"""
    values_at: int
    """of the terms' values"""
    learned_max: float
    share: float
    """g"""
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
    beta: float = 0.1


def pairs_of(size: int) -> int:
    """Return the numbers of a part: the lower half of a symmetric matrix."""
    return size * (size + 1) // 2  # integers


def columns_of(constants: LearningConstants) -> int:
    """Return how many columns the disturbance has."""
    n = len(constants.largest)
    return len(constants.noises) // (n * n)  # integers


def add_parts(constants: LearningConstants, coder: Numbers, known: Results) -> None:
    """Add the lower halves of all parts of P, of the corrected states."""
    pairs = pairs_of(len(constants.largest) + len(constants.drifts))
    for part in range(columns_of(constants) + 1):
        for at in range(len(known)):
            known[at] += coder[part * pairs + at]


def ask(constants: LearningConstants, coder: Numbers, c: Results, v: Results) -> bool:
    """Write the direction and P_xx c; return whether there is one: not when P is zero."""
    known = [0.0] * pairs_of(len(constants.largest))
    add_parts(constants, coder, known)
    return point(constants.worth, known, c, v)


def take(
    constants: LearningConstants, coder: Results, c: Numbers, sign: int, correction: Results
) -> None:
    """Steps 2 to 6: add what a sign means for x and theta, and write what is known after it."""
    n, columns = len(constants.largest), columns_of(constants)
    size = n + len(constants.drifts)
    pairs = pairs_of(size)
    each = [0.0] * ((columns + 1) * size)
    v = [0.0] * size
    weights = [0.0] * (columns + 1)
    for part in range(columns + 1):
        at, row = part * pairs, part * size
        for i in range(n):
            for j in range(i):
                each[row + i] += coder[at] * c[j]
                each[row + j] += coder[at] * c[i]
                at += 1
            each[row + i] += coder[at] * c[i]
            at += 1
        for i in range(n, size):
            for j in range(n):
                each[row + i] += coder[at + j] * c[j]
            at += i + 1
        for i in range(size):
            v[i] += each[row + i]
        for i in range(n):
            weights[part] += c[i] * each[row + i]
    agreed = 0.0
    agrees = [0.0] * columns
    changes = [0.0] * columns
    growths = [0.0] * columns
    total_change = 0.0
    for part in range(columns):
        first = (columns + 1) * pairs + part * (n + 2)
        d = 0.0
        for i in range(n):
            d += c[i] * coder[first + i]
        agrees[part] = sign * d / math.sqrt(d * d + constants.delta)
        weight = weights[part]
        agreed += weight * agrees[part]
        for i in range(n):
            moved = 2.0 * each[part * size + i] - weight * v[i]
            coder[first + i] += constants.kappa * sign * moved - constants.a * d * v[i]
        run = coder[first + n] + constants.mu * weight * (agrees[part] - coder[first + n])
        coder[first + n] = run
        cube = run * run * run if run > 0.0 else 0.0
        growths[part] = constants.gamma * weight * cube
        changes[part] = weight * (constants.k * (agrees[part] + constants.beta) + constants.eta * cube)
        total_change += changes[part]
    step = constants.kappa * (1.0 + constants.tau * agreed) * sign
    for i in range(n):
        correction[i] += step * v[i]
    for i in range(n, size):
        correction[constants.learned_at + i - n] += step * v[i]
    share = constants.share
    for part in range(columns + 1):
        at = part * pairs
        half = 0.5 * share * share * weights[part]
        for i in range(size):
            each[part * size + i] = share * each[part * size + i] - half * v[i]
            one, other = v[i], each[part * size + i]
            for j in range(i + 1):
                coder[at] -= one * each[part * size + j] + other * v[j]
                at += 1
    for part in range(columns):
        change = (1.0 - SHARED) * changes[part] + SHARED * total_change
        strengthen(constants, coder, part, growths[part], 1.0 + change)


def strengthen(
    constants: LearningConstants, coder: Results, part: int, growth: float, factor: float
) -> None:
    """Let a column's part grow along D, and multiply its strength by a factor, within the limits."""
    n, pairs = len(constants.largest), pairs_of(len(constants.largest) + len(constants.drifts))
    first = (columns_of(constants) + 1) * pairs + part * (n + 2)
    before = coder[first + n + 1]
    after = before * factor
    if after < constants.smallest_strength:
        after = constants.smallest_strength
    if after > constants.largest_strength:
        after = constants.largest_strength
    factor = after / before
    square = factor * factor
    at = part * pairs
    for i in range(n):
        for j in range(i + 1):
            coder[at] = square * (coder[at] + growth * (coder[first + i] * coder[first + j]))
            at += 1
    for i in range(n):
        coder[first + i] = factor * coder[first + i]
    coder[first + n + 1] = after


def wait(constants: LearningConstants, coder: Results, values: Numbers) -> None:
    """Let the parts and D grow over a sample in which the terms have these values."""
    n, columns = len(constants.largest), columns_of(constants)
    learned = len(constants.drifts)
    pairs = pairs_of(n + learned)
    transition = constants.transition
    turned = [0.0] * n
    for part in range(columns + 1):
        move(constants, coder, part, values)
        if part == columns:
            for i in range(learned):
                coder[part * pairs + place(n + i, n + i)] += constants.drifts[i]
        else:
            first = (columns + 1) * pairs + part * (n + 2)
            variance = coder[first + n + 1] * coder[first + n + 1]
            at = part * pairs
            for i in range(n):
                for j in range(i + 1):
                    coder[at] += variance * constants.noises[(part * n + i) * n + j]
                    at += 1
                total = 0.0
                for j in range(n):
                    total += transition[i * n + j] * coder[first + j]
                turned[i] = total
            for i in range(n):
                coder[first + i] = turned[i]
    excess = 1.0
    for i in range(n):
        variance = 0.0
        for part in range(columns + 1):
            variance += coder[part * pairs + place(i, i)]
        if variance > excess * constants.largest[i]:
            excess = variance / constants.largest[i]
    if excess > 1.0:
        for at in range((columns + 1) * pairs):
            coder[at] = coder[at] / excess


def move(constants: LearningConstants, coder: Results, part: int, values: Numbers) -> None:
    """Write [F, Y; 0, I] P_j [F, Y; 0, I]' for one part."""
    n, learned = len(constants.largest), len(constants.drifts)
    size = n + learned
    sums = len(constants.reach) // n  # integers
    begin = part * pairs_of(size)
    transition, reach, rows = constants.transition, constants.reach, constants.rows
    # P of x and everything, and what the terms of each row add up to: Y theta is `reach` times these.
    full = [0.0] * (n * size)
    added = [0.0] * (sums * size)
    at = begin
    for i in range(n):
        for j in range(i + 1):
            full[i * size + j] = full[j * size + i] = coder[at]
            at += 1
    for i in range(learned):
        value, row = values[i], rows[i] * size
        for j in range(n):
            full[j * size + n + i] = coder[at + j]
            added[row + j] += value * coder[at + j]
        at += n
        for j in range(i):
            added[row + n + j] += value * coder[at]
            added[rows[j] * size + n + i] += values[j] * coder[at]
            at += 1
        added[row + n + i] += value * coder[at]
        at += 1
    moved = [0.0] * (n * size)
    for i in range(n):
        row = i * size
        for k in range(n):
            share = transition[i * n + k]
            if share != 0.0:
                at = k * size
                for j in range(size):
                    moved[row + j] += share * full[at + j]
        for k in range(sums):
            share = reach[i * sums + k]
            if share != 0.0:
                at = k * size
                for j in range(size):
                    moved[row + j] += share * added[at + j]
    shares = [0.0] * sums
    at = begin
    for i in range(n):
        row = i * size
        for k in range(sums):
            shares[k] = 0.0
        for k in range(learned):
            shares[rows[k]] += values[k] * moved[row + n + k]
        for j in range(i + 1):
            total = 0.0
            for k in range(n):
                total += moved[row + k] * transition[j * n + k]
            for k in range(sums):
                total += shares[k] * reach[j * sums + k]
            coder[at] = total
            at += 1
    for i in range(learned):
        for j in range(n):
            coder[at + j] = moved[j * size + n + i]
        at += n + i + 1


def learning_encode(
    constants: LearningConstants,
    coder: Numbers,
    predicted: Numbers,
    measurement: Numbers,
    symbols: SymbolResults,
) -> None:
    """Write the signs of the errors along the directions asked for; vectors are of corrected states."""
    n = len(constants.largest)
    own = [0.0] * len(coder)
    for i in range(len(coder)):
        own[i] = coder[i]
    c, v = [0.0] * n, [0.0] * n
    correction = [0.0] * len(predicted)
    for bit in range(len(symbols)):
        symbols[bit] = 1
        if ask(constants, own, c, v):
            error = 0.0
            for i in range(n):
                error += c[i] * (measurement[i] - predicted[i] - correction[i])
            if error < 0.0:
                symbols[bit] = -1
            if bit + 1 < len(symbols):
                take(constants, own, c, symbols[bit], correction)


def learning_decode(
    constants: LearningConstants,
    coder: Numbers,
    model: Numbers,
    symbols: Symbols,
    erased: bool,
    correction: Results,
    after: Results,
) -> None:
    """Write the correction of the model's states and the coder state at the next sample."""
    n, learned = len(constants.largest), len(constants.drifts)
    for i in range(len(after)):
        after[i] = coder[i]
    for i in range(len(correction)):
        correction[i] = 0.0
    if not erased:
        c, v = [0.0] * n, [0.0] * n
        for bit in range(len(symbols)):
            if ask(constants, after, c, v):
                take(constants, after, c, symbols[bit], correction)
        most = constants.learned_max
        for at in range(constants.learned_at, constants.learned_at + learned):
            if model[at] + correction[at] > most:
                correction[at] = most - model[at]
            if model[at] + correction[at] < -most:
                correction[at] = -most - model[at]
    values = [0.0] * learned
    for i in range(learned):
        values[i] = model[constants.values_at + i]
    wait(constants, after, values)
