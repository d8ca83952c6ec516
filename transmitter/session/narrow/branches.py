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
        own = self._machine.commands_in(members[0][1].outlook(self._machine))
        asked = len([one for one in heard[:own] if one is not None])
        hashes = len([one for one in heard[own:] if one is not None])
        predicted = 0.0
        for weight, node in members:
            state = node.outlook(self._machine)
            count = self._machine.commands_in(state)
            chance = sum(share for _, share in self._options(state, heard[:count]))
            predicted += weight * (chance if count == own else 0.5**asked)
        for weight, node in self._flown(members, sent, heard, found.spilled):
            count = self._machine.commands_in(node.state)
            hashed = self._hash_chances(node.state, heard[count:], node.digest(self._machine))
            chances = self._chances(sent, node.word)
            arrived = []
            for symbols, share in self._options(node.state, heard[:count]):
                as_heard, if_erased = hashed[parity(symbols)]
                arrived.append((symbols, as_heard * share))
                if chances.as_sent > 0.0:
                    arrives = weight * chances.as_sent * as_heard * share
                    found.branches.append((arrives, node, sent, symbols))
                erased = weight * chances.erased * if_erased * share
                found.branches.append((erased, node, ERASED, symbols))
            if chances.changed > 0.0:
                flips.append((weight * chances.changed, node, arrived))
            if chances.otherwise > 0.0:
                share = sum(one for _, one in arrived)
                found.spilled.append((weight * chances.otherwise * share, node))
        if sent is not ERASED and found.branches:
            self._add_changed(sent, flips, found)
        return found._replace(rest_factor=0.5**hashes * max(0.5**asked, predicted))

    def _flown(
        self, members: Members, sent: Word, heard: Symbols, spilled: list[tuple[float, Node]]
    ) -> Members:
        """Fly the members that weigh enough, and make one of those that have come to the same state."""
        machine, best = self._machine, 0.0
        kept: dict[TwoWayState, tuple[float, Node]] = {}
        for weight, node in members:
            if not node.is_flown:
                left = weight * self._chance(node, node.outlook(machine), sent, heard, None)
                if left < self._dropped_below * best or not node.fly(machine):
                    spilled.append((left, node))
                    continue
            digest = node.digest(machine)
            left = weight * self._chance(node, node.state, sent, heard, digest)
            best = left if left > best else best
            if node.state in kept:
                other, first = kept[node.state]
                kept[node.state] = (other + weight, first)
                first.doubt(node, weight)
            else:
                kept[node.state] = (weight, node)
        return list(kept.values())

    def _chance(
        self, node: Node, state: TwoWayState, sent: Word, heard: Symbols, digest: int | None
    ) -> float:
        """Return the chance of what came; without a digest, of its command and first hash symbols."""
        count = self._machine.commands_in(state)
        asked = heard[count:] if digest is not None else heard[count : count + 1]
        hashed = self._hash_chances(state, asked, digest or 0)
        lost = self._chances(sent, node.word).erased
        total = 0.0
        for symbols, share in self._options(state, heard[:count]):
            as_heard, if_erased = hashed[parity(symbols)]
            total += share * ((1.0 - lost) * as_heard + lost * if_erased)
        return total

    def _chances(self, sent: Word, before: Word) -> Chances:
        if sent is ERASED:
            return Chances(0.0, 1.0, 0.0, 0.0)
        erased, flip = self._priors.erased(before), self._priors.flipped
        arrived, others = 1.0 - erased, self._others(sent)
        more = 0.5 * flip * flip * (len(sent) - 1) / len(sent)
        return Chances(arrived * (1.0 - flip), erased, arrived * (flip - more) / others, arrived * more)

    def _others(self, sent: tuple[int, ...]) -> int:
        """Return how many words differ from this one in one symbol."""
        return len(sent) * (len(self._machine.codec.coder.alphabet.symbols) - 1)

    def _hash_chances(
        self, state: TwoWayState, heard: Symbols, digest: int
    ) -> tuple[tuple[float, float], ...]:
        """Return how likely these hash symbols come down with a word that is whole, and with none.

        First with command symbols of even parity, then of odd.
        """
        found = []
        flip = self._priors.down_flipped
        bits = self._machine.hashed(state, digest)
        for odd in (0, 1):
            whole = erased = 1.0
            for place, one in enumerate(heard):
                if one is not None:
                    same = (bits ^ odd) >> place & 1 == one
                    whole *= 1.0 - flip if same else flip
                    erased *= flip if same else 1.0 - flip
            found.append((whole, erased))
        return tuple(found)

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
