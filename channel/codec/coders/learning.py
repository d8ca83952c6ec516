"""The coder `learning`: that of `direction`, which learns the plant from the same bits.

Its arithmetic is in `learning_steps`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from channel.codec.codec import Alphabet, Codec, CodecState, Vector
from channel.codec.coders.base import CoderFunctions, FunctionCoder, Numbers
from channel.codec.coders.direction import GROWTH_MAX, check_steps
from channel.codec.coders.learning_steps import (
    LearningConstants,
    add_parts,
    ask,
    columns_of,
    learning_decode,
    learning_encode,
    pairs_of,
    take,
)
from channel.codec.coders.symmetric import check_symmetric, deviations, most_correlated, place
from channel.codec.models.learned import LearnedModel
from channel.codec.models.linear import Rows, check, flat


@dataclass(frozen=True, slots=True)
class LearningParameters:
    """Parameters; the matrices are those of the corrected states, for one sample."""

    transition: Rows
    """F"""
    noises: tuple[Rows, ...]
    """Q of each column of the disturbance"""
    worth: Rows
    """N"""
    starts: tuple[Rows, ...]
    """P before the first word, of each column"""
    reach: Rows
    """what a constant rate of each state, a column, adds in a sample"""
    spreads: tuple[float, ...]
    """standard deviation of each learned parameter before the first word"""
    drift: float = 0.0
    """of a learned parameter in a sample, as a share of its spread"""
    learned_max: float = 0.3
    """of the size of a learned parameter"""
    bits: int = 1
    """signs per sample"""
    adapts: bool = True
    """follow a disturbance of unknown strength; False: it is as Q says"""
    removed: float = 0.67
    """alpha"""
    step: float = 1.0
    """kappa"""
    minimum_strength: float = 1e-2
    maximum_strength: float = 1e3
    """sigma of each column"""


class LearningCoder(FunctionCoder):
    """One or more signs per sample for all corrected states of a plant, and for the learned terms.

    Coder state: the lower halves of the parts of P; then D, m and sigma of each column. `term_rows`
    says of which state's rate each term is, `learned_at` where theta begins in the model's state, of
    which the first `correction_size` take corrections; the terms' values follow. `readout` is C, as
    in `channel.codec.coders.direction`.
    """

    functions = CoderFunctions(learning_encode, learning_decode, allocates=True)
    impulse = True
    uses_rates = True

    def __init__(
        self,
        parameters: LearningParameters,
        term_rows: Sequence[int],
        learned_at: int,
        readout: Rows = (),
    ) -> None:
        p = parameters
        size, learned = len(p.transition), len(p.spreads)
        check_parameters(p, term_rows)
        self.parameters = p
        self.readout = readout or [[0.0 + (row == at) for at in range(size)] for row in range(size)]
        self.alphabet = Alphabet((-1, 1), p.bits)
        self.learned_at = learned_at
        self.correction_size = learned_at + learned
        reached = sorted({*term_rows})
        self.constants = LearningConstants(
            flat(p.transition),
            tuple([value for rows in p.noises for value in flat(rows)]),
            flat(p.worth),
            tuple([row[place] for row in p.reach for place in reached]),
            tuple([GROWTH_MAX * total for total in self._start_variances()]),
            tuple([p.drift * spread * p.drift * spread for spread in p.spreads]),
            tuple([reached.index(row) for row in term_rows]),
            learned_at,
            self.correction_size,
            p.learned_max,
            1.0 - math.sqrt(1.0 - p.removed),
            p.step,
            p.minimum_strength,
            p.maximum_strength,
            0.01 if p.adapts else 0.0,
            0.02 if p.adapts else 0.0,
        )
        self._pairs = pairs_of(size + learned)

    def _start_variances(self) -> Vector:
        found = []
        for state in range(len(self.parameters.transition)):
            total = 0.0
            for rows in self.parameters.starts:
                total += rows[state][state]
            found.append(total)
        return tuple(found)

    def initial(self) -> Vector:
        """Return the state of both ends before the first word."""
        size, spreads = len(self.parameters.transition), self.parameters.spreads
        nothing = [0.0] * (self._pairs - pairs_of(size))
        found: list[float] = []
        for rows in self.parameters.starts:
            found += [rows[row][column] for row in range(size) for column in range(row + 1)]
            found += nothing
        learned = [0.0] * self._pairs
        for at, spread in enumerate(spreads, size):
            learned[place(at, at)] = spread * spread
        found += learned
        for _ in self.parameters.starts:
            found += [*[0.0] * (size + 1), 1.0]
        return tuple(found)

    def is_state(self, coder: Vector) -> bool:
        """Return whether the variances are within their limits, and the strengths within their own."""
        smallest, largest = self.parameters.minimum_strength, self.parameters.maximum_strength
        states = len(self.constants.largest)
        columns = columns_of(self.constants)
        strengths = [coder[-1 - (states + 2) * column] for column in range(columns)]
        known = self.known(coder)
        limits = self.constants.largest
        return all(smallest <= one <= largest for one in strengths) and all(
            0.0 <= known[place(state, state)] <= 2.0 * limit for state, limit in enumerate(limits)
        )

    def known(self, coder: Numbers) -> list[float]:
        """Return the lower half of P, of the corrected states."""
        found = [0.0] * pairs_of(len(self.constants.largest))
        add_parts(self.constants, coder, found)
        return found

    def learned_deviations(self, coder: Vector) -> Vector:
        """Return the standard deviation of each learned parameter that both ends assume."""
        size = len(self.constants.largest)
        found = []
        for at in range(size, size + len(self.parameters.spreads)):
            total = 0.0
            for part in range(columns_of(self.constants) + 1):
                total += coder[part * self._pairs + place(at, at)]
            found.append(math.sqrt(total if total > 0.0 else 0.0))
        return tuple(found)

    def about(self, coder: Vector, word: Sequence[int], correction: Numbers) -> tuple[int, ...]:
        """Return, for each sign, the output whose error correlates most with what was asked."""
        if len(word) == 1:  # along v
            return (most_correlated(self.readout, self.known(coder), correction),)
        own = list(coder)
        size = len(self.constants.largest)
        c, v, moved = [0.0] * size, [0.0] * size, [0.0] * self.correction_size
        found = []
        for sign in word:
            asked = ask(self.constants, own, c, v)
            found.append(most_correlated(self.readout, self.known(own), v) if asked else 0)
            if asked:
                take(self.constants, own, c, sign, moved)
        return tuple(found)

    def ranges(self, coder: Vector) -> Vector:
        """Return, for each output, the standard deviation that both ends assume."""
        return deviations(self.readout, self.known(coder), 1.0)


def check_parameters(parameters: LearningParameters, term_rows: Sequence[int]) -> None:
    """Raise ValueError where the parameters make no coder."""
    p, size = parameters, len(parameters.transition)
    check_steps(p.bits, p.removed, p.minimum_strength, 1.0, p.maximum_strength)
    for name in ("transition", "worth", "reach"):
        check(name, getattr(p, name), size, size)
    check_symmetric("worth", p.worth)
    if len(p.noises) != len(p.starts) or not p.noises:
        raise ValueError(
            f"noises has {len(p.noises)} matrices and starts {len(p.starts)}; each needs one for every "
            "column of the disturbance"
        )
    for name in ("noises", "starts"):
        for number, rows in enumerate(getattr(p, name), 1):
            check(f"{name}, matrix {number},", rows, size, size)
            check_symmetric(f"{name}, matrix {number},", rows)
    if len(p.spreads) != len(term_rows) or not all(0.0 < one <= p.learned_max for one in p.spreads):
        raise ValueError(
            f"spreads must be a number for each of {len(term_rows)} terms of the model, above 0 and at "
            f"most learned_max = {p.learned_max:g}; they are {', '.join(map(str, p.spreads)) or 'none'}"
        )
    for state in range(size):
        if not any(rows[state][state] > 0.0 for rows in p.starts):
            raise ValueError(f"starts must be above 0 on a diagonal for every state, not {state + 1}")


class Learned(NamedTuple):
    """The estimate of a term at both ends."""

    error: float
    """relative to the configured one; of a force, the force"""
    deviation: float
    """standard deviation that they assume of it"""


def learned_of(codec: Codec, state: CodecState) -> dict[str, Learned]:
    """Return what a codec has learned of its plant, by the terms' names; nothing if it does not."""
    model, coder = codec.model, codec.coder
    if not (isinstance(model, LearnedModel) and isinstance(coder, LearningCoder)):
        return {}
    errors = state.model[coder.learned_at : coder.correction_size]
    pairs = zip(errors, coder.learned_deviations(state.coder), strict=True)
    return {name: Learned(*pair) for name, pair in zip(model.terms, pairs, strict=True)}
