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

LOST = 2
Hashed = tuple[tuple[float, float, float], ...]
"""Chance of the hash symbols that came, with a word of even parity, of odd, and with none: first with
command symbols of even parity, then of odd."""


Flip = tuple[float, Node, Symbols, tuple[float, float, float]]
"""Weight of a changed word before the hash symbols, what it branches from, command symbols, and the
chances of the hash symbols."""


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
        flips: list[Flip] = []
        chances = {before: self._chances(sent, before) for before in (False, True)}
        odd = self._machine.word_parity(sent)
        weighed, rest_factor = self._weighed(members, chances, odd, heard, found.spilled)
        for weight, node, options, hashed in weighed:
            as_sent, erased, changed, otherwise = chances[node.word is ERASED]
            for symbols, share in options:
                came = hashed[parity(symbols)]
                if as_sent > 0.0:
                    found.branches.append((weight * as_sent * came[odd] * share, node, sent, symbols))
                found.branches.append((weight * erased * came[LOST] * share, node, ERASED, symbols))
                if changed > 0.0:
                    flips.append((weight * changed * share, node, symbols, came))
                if otherwise > 0.0:
                    more = max(came[0], came[1])
                    found.spilled.append((weight * otherwise * more * share, node))
        if sent is not ERASED and found.branches:
            self._add_changed(sent, flips, found)
        return found._replace(rest_factor=rest_factor)

    def _weighed(
        self,
        members: Members,
        chances: dict[bool, Chances],
        odd: int,
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
                left = weight * _chance(options, hashed, odd, lost)
                if left < self._dropped_below * best or not node.fly(machine):
                    spilled.append((left, node))
                    continue
            hashed = self._hash_chances(node.state, heard[count:], node.digest(machine))
            left = weight * _chance(options, hashed, odd, lost)
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
        erased, flip = self._priors.erased(after_erasure), self._priors.flipped.value
        arrived, others = 1.0 - erased, self._others(sent)
        more = 0.5 * flip * flip * (len(sent) - 1) / len(sent)
        return Chances(arrived * (1.0 - flip), erased, arrived * (flip - more) / others, arrived * more)

    def _others(self, sent: tuple[int, ...]) -> int:
        """Return how many words differ from this one in one symbol."""
        return len(sent) * (len(self._machine.codec.coder.alphabet.symbols) - 1)

    def _hash_chances(self, state: TwoWayState, heard: Symbols, digest: int) -> Hashed:
        """Return how likely these hash symbols come down; without digest, for the first one alone."""
        flip, bits = self._priors.down_flipped.value, self._machine.hashed(state, digest)
        # Of the first symbol, the second, and all others, with a word that is whole and with none.
        first = second = others = (1.0, 1.0)
        for place, one in enumerate(heard):
            if one is not None:
                pair = (1.0 - flip, flip) if bits >> place & 1 == one else (flip, 1.0 - flip)
                if place == 0:
                    first = pair
                elif place == 1:
                    second = pair
                else:
                    others = (others[0] * pair[0], others[1] * pair[1])
        found = []
        for whole, erased in (first, first[::-1]):
            whole, erased = whole * others[0], erased * others[1]
            found.append((whole * second[0], whole * second[1], erased * second[1]))
        return tuple(found)

    def _options(self, state: TwoWayState, heard: Symbols) -> list[Option]:
        """Return all command symbols of a sample, with their chances and those of what came."""
        scheme, priors = self._machine.scheme, self._priors
        flip, news = priors.down_flipped.value, priors.news.value
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

    def _add_changed(self, sent: tuple[int, ...], flips: Sequence[Flip], found: Branched) -> None:
        """Add the words that differ from the one sent in one symbol, where they weigh enough."""
        least = self._dropped_below * max(one[0] for one in found.branches)
        alphabet = self._machine.codec.coder.alphabet.symbols
        words = [
            (*sent[:place], symbol, *sent[place + 1 :])
            for place in range(len(sent))
            for symbol in alphabet
            if symbol != sent[place]
        ]
        parities = [self._machine.word_parity(word) for word in words]
        for weight, node, symbols, came in flips:
            most = weight * max(came[0], came[1])
            if most < least:
                found.spilled.append((len(words) * most, node))
                continue
            for word, odd in zip(words, parities, strict=True):
                found.branches.append((weight * came[odd], node, word, symbols))


def _chance(options: list[Option], hashed: Hashed, odd: int, lost: float) -> float:
    """Return the chance of what came, with the word as it was sent, or erased."""
    total = 0.0
    for symbols, share in options:
        came = hashed[parity(symbols)]
        total += share * ((1.0 - lost) * came[odd] + lost * came[LOST])
    return total
