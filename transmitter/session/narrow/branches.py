"""How hypotheses branch in a sample, and what the down symbols that came say of each branch.

A word comes as it was sent, erased, or with one of its symbols changed into another: one branch for
each. Words with more than one changed symbol are not followed; their weight goes to the rest. Command
symbols branch into 0 and 1, weighed by what came; hash symbols need no branch, for they follow from
the state before the word, and from whether the word is erased.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from channel.codec.codec import ERASED, Vector, Word
from channel.codec.downlink.machine import TwoWay, TwoWayState, parity
from transmitter.session.narrow.paths import Node, Symbols
from transmitter.session.narrow.priors import Priors

Members = Sequence[tuple[float, Node]]
Option = tuple[Symbols, float]
"""Command symbols of a sample, and their chance together with that of what came."""

Hashed = tuple[tuple[float, float], tuple[float, float]]
"""Chance of the hash symbols that came, with a word that is whole and with one that is erased: first
with command symbols of even parity, then of odd."""


class Branched(NamedTuple):
    """All branches of a list in a sample."""

    branches: list[tuple[float, Node, Word, Symbols]]
    """weight, what it branches from, word, command symbols"""
    rest_factor: float
    """what the rest is multiplied by"""
    spilled: list[tuple[float, Node]]
    """weight that is not followed, and what it would have branched from"""


class Chances(NamedTuple):
    """How likely a word comes in each way."""

    as_sent: float
    erased: float
    changed: float
    """as each single word that differs in one symbol"""
    otherwise: float
    """with more than one symbol changed"""


class Weighed(NamedTuple):
    """A hypothesis that goes on, and what the symbols that came say of it."""

    weight: float
    node: Node
    options: list[Option]
    hashed: Hashed


class Branching:
    """Makes the branches; see the module's text. `dropped_below`: of the heaviest one's weight.

    A hypothesis that was not flown yet is weighed first by what is known without: the command symbols,
    and the first hash symbol. Where that leaves too little of it, it is dropped and never flown.
    """

    def __init__(self, machine: TwoWay, priors: Priors, dropped_below: float) -> None:
        self._machine = machine
        self._priors = priors
        self._dropped_below = dropped_below

    def of(self, members: Members, sent: Word, heard: Symbols) -> Branched:
        """Return the branches of a list's members, best first; None in `heard`: erased."""
        found = Branched([], 1.0, [])
        flips: list[tuple[float, Node, list[Option]]] = []
        chances = {before: self._chances(sent, before) for before in (False, True)}
        weighed, rest_factor = self._weighed(members, chances, heard, found.spilled)
        for weight, node, options, hashed in weighed:
            as_sent, erased, changed, otherwise = chances[node.word is ERASED]
            arrived = []
            for symbols, share in options:
                as_heard, if_erased = hashed[parity(symbols)]
                arrived.append((symbols, as_heard * share))
                if as_sent > 0.0:
                    found.branches.append((weight * as_sent * as_heard * share, node, sent, symbols))
                found.branches.append((weight * erased * if_erased * share, node, ERASED, symbols))
            if changed > 0.0:
                flips.append((weight * changed, node, arrived))
            if otherwise > 0.0:
                found.spilled.append((weight * otherwise * sum(one for _, one in arrived), node))
        if sent is not ERASED and found.branches:
            self._add_changed(sent, flips, found)
        return found._replace(rest_factor=rest_factor)

    def _weighed(
        self,
        members: Members,
        chances: dict[bool, Chances],
        heard: Symbols,
        spilled: list[tuple[float, Node]],
    ) -> tuple[list[Weighed], float]:
        """Return those that weigh enough, flown, and the factor of the rest.

        Of several that have come to the same state one goes on.
        """
        machine, best, predicted = self._machine, 0.0, 0.0
        own = machine.commands_in(members[0][1].outlook(machine))
        asked = len([one for one in heard[:own] if one is not None])
        hashes = len([one for one in heard[own:] if one is not None])
        kept: dict[TwoWayState, Weighed] = {}
        for weight, node in members:
            state, lost = node.outlook(machine), chances[node.word is ERASED].erased
            count = machine.commands_in(state)
            options = self._options(state, heard[:count])
            predicted += weight * (sum(one for _, one in options) if count == own else 0.5**asked)
            if not node.is_flown:
                hashed = self._hash_chances(state, heard[count : count + 1], 0)
                left = weight * _chance(options, hashed, lost)
                if left < self._dropped_below * best or not node.fly(machine):
                    spilled.append((left, node))
                    continue
            hashed = self._hash_chances(node.state, heard[count:], node.digest(machine))
            left = weight * _chance(options, hashed, lost)
            best = left if left > best else best
            first = kept.get(node.state)
            if first is not None:
                first.node.doubt(node, weight)
                weight, node = weight + first.weight, first.node
            kept[node.state] = Weighed(weight, node, options, hashed)
        return list(kept.values()), 0.5**hashes * max(0.5**asked, predicted)

    def _chances(self, sent: Word, after_erasure: bool) -> Chances:
        if sent is ERASED:
            return Chances(0.0, 1.0, 0.0, 0.0)
        erased, flip = self._priors.erased(after_erasure), self._priors.flipped
        arrived, others = 1.0 - erased, self._others(sent)
        more = 0.5 * flip * flip * (len(sent) - 1) / len(sent)
        return Chances(arrived * (1.0 - flip), erased, arrived * (flip - more) / others, arrived * more)

    def _others(self, sent: tuple[int, ...]) -> int:
        """Return how many words differ from this one in one symbol."""
        return len(sent) * (len(self._machine.codec.coder.alphabet.symbols) - 1)

    def _hash_chances(self, state: TwoWayState, heard: Symbols, digest: int) -> Hashed:
        """Return how likely these hash symbols come down; without digest, for the first one alone."""
        flip, bits = self._priors.down_flipped, self._machine.hashed(state, digest)
        whole = erased = 1.0
        for place in range(1, len(heard)):
            if heard[place] is not None:
                same = bits >> place & 1 == heard[place]
                whole *= 1.0 - flip if same else flip
                erased *= flip if same else 1.0 - flip
        if not heard or heard[0] is None:
            return (whole, erased), (whole, erased)
        one, other = (1.0 - flip, flip) if bits & 1 == heard[0] else (flip, 1.0 - flip)
        return (whole * one, erased * other), (whole * other, erased * one)

    def _options(self, state: TwoWayState, heard: Symbols) -> list[Option]:
        """Return all command symbols of a sample, with their chances and those of what came."""
        scheme, flip, news = self._machine.scheme, self._priors.down_flipped, self._priors.news
        found: list[tuple[Symbols, float, Vector]] = [((), 1.0, state.down)]
        for place, came in enumerate(heard):
            longer = []
            for symbols, chance, down in found:
                one = news if scheme.is_idle(down) else 0.5
                for symbol in (0, 1):
                    share = chance * (one if symbol else 1.0 - one)
                    if came is not None:
                        share *= 1.0 - flip if symbol == came else flip
                    after = scheme.take(down, symbol) if place + 1 < len(heard) else down
                    longer.append(((*symbols, symbol), share, after))
            found = longer
        return [(symbols, share) for symbols, share, _ in found]

    def _add_changed(
        self,
        sent: tuple[int, ...],
        flips: Sequence[tuple[float, Node, list[Option]]],
        found: Branched,
    ) -> None:
        """Add the words that differ from the one sent in one symbol, where they weigh enough."""
        least = self._dropped_below * max(one[0] for one in found.branches)
        alphabet = self._machine.codec.coder.alphabet.symbols
        for weight, node, options in flips:
            for symbols, share in options:
                if weight * share < least:
                    found.spilled.append((self._others(sent) * weight * share, node))
                    continue
                for place in range(len(sent)):
                    for symbol in alphabet:
                        if symbol != sent[place]:
                            word = (*sent[:place], symbol, *sent[place + 1 :])
                            found.branches.append((weight * share, node, word, symbols))


def _chance(options: list[Option], hashed: Hashed, lost: float) -> float:
    """Return the chance of what came, over all branches."""
    total = 0.0
    for symbols, share in options:
        as_heard, if_erased = hashed[parity(symbols)]
        total += share * ((1.0 - lost) * as_heard + lost * if_erased)
    return total
