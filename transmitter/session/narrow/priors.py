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
        self._erased = Share(0.025)
        self._erased_again = Share(0.4, 2.5)
        self._flipped = Share(0.005)
        self._down_flipped = Share(0.005)
        self._news = Share(0.1)

    def erased(self, after_erasure: bool) -> float:
        """Return how likely a word is erased."""
        return (self._erased_again if after_erasure else self._erased).value

    @property
    def flipped(self) -> float:
        """How likely one symbol of a word that arrived is another than was sent."""
        return self._flipped.value

    @property
    def down_flipped(self) -> float:
        """How likely a down symbol that arrived is the other one."""
        return self._down_flipped.value

    @property
    def news(self) -> float:
        """How likely a command symbol is 1 that says if there is news."""
        return self._news.value

    def learn(self, sent: Word, word: Word, before: Word) -> None:
        """Learn from a confirmed word, what was sent for it, and the word before it."""
        if sent is ERASED:
            return
        (self._erased_again if before is ERASED else self._erased).count(word is ERASED)
        if word is not ERASED:
            self._flipped.count(word != sent)

    def learn_symbols(self, sent: Sequence[int], heard: Sequence[int | None]) -> None:
        """Learn from the down symbols of a confirmed sample."""
        for one, other in zip(sent, heard, strict=True):
            if other is not None:
                self._down_flipped.count(one != other)

    def learn_news(self, news: bool) -> None:
        """Learn from a command symbol that says if there is news."""
        self._news.count(news)
