"""How likely each fault of the line is: assumed at first, then learned from confirmed samples.

Each is a share of recent cases, the last 500 or so, and never so small that one surprise says
nothing. Erasures come in bursts on many lines, so an erasure after an erasure has a share of its own.
"""

from __future__ import annotations

from collections.abc import Sequence

from channel.codec.codec import ERASED, Word

MEMORY = 0.998
"""What a case counts for when the next one has come."""


class Share:
    """The share of cases in which something happened, beginning with `cases` made-up ones."""

    def __init__(self, share: float, cases: float = 10.0) -> None:
        self._prior = (share * cases, cases)
        self._hits = 0.0
        self._cases = 0.0

    def count(self, hit: bool) -> None:
        self._hits = MEMORY * self._hits + hit
        self._cases = MEMORY * self._cases + 1.0

    @property
    def value(self) -> float:
        hits, cases = self._prior
        return (self._hits + hits) / (self._cases + cases)


class Priors:
    """The shares of a line of both directions."""

    def __init__(self) -> None:
        self._erased = {False: Share(0.025), True: Share(0.4, 2.5)}
        """words; by whether the word before was erased"""
        self.flipped = Share(0.005)
        """of words that arrived: one symbol is another than was sent"""
        self.down_flipped = Share(0.005)
        """of down symbols that arrived"""
        self.news = Share(0.1)
        """of command symbols that say if there is news: there is"""

    def erased(self, after_erasure: bool) -> float:
        """Return how likely a word is erased."""
        return self._erased[after_erasure].value

    def learn(self, sent: Word, word: Word, before: Word) -> None:
        """Learn from a confirmed word, what was sent for it, and the word before it."""
        if sent is ERASED:
            return
        self._erased[before is ERASED].count(word is ERASED)
        if word is not ERASED:
            self.flipped.count(word != sent)

    def learn_symbols(self, sent: Sequence[int], heard: Sequence[int | None]) -> None:
        """Learn from the down symbols of a confirmed sample."""
        for one, other in zip(sent, heard, strict=True):
            if other is not None:
                self.down_flipped.count(one != other)
