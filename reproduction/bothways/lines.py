"""Lines that lose and flip symbols, each with chances of its own, so that flights can be paired."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from random import Random

from channel.codec.codec import ERASED, Alphabet, Word


class Line:
    """Loses and flips symbols one by one, or in bursts (chance to enter, chance to leave)."""

    def __init__(
        self, seed: str, loss: float = 0.0, flip: float = 0.0, burst: tuple[float, float] = (0.0, 1.0)
    ) -> None:
        self._random = Random(seed)
        self._loss, self._flip = loss, flip
        self._enter, self._leave = burst
        self._lost = False

    def carry(self, symbol: int, symbols: Sequence[int]) -> int | None:
        chance = self._random.random()
        self._lost = chance >= self._leave if self._lost else chance < self._enter
        lost, flipped = self._random.random() < self._loss, self._random.random() < self._flip
        other = self._random.randrange(len(symbols) - 1)
        if self._lost or lost:
            return None
        if not flipped:
            return symbol
        return [one for one in symbols if one != symbol][other]

    def carry_word(self, word: tuple[int, ...], alphabet: Alphabet) -> Word:
        came = [self.carry(symbol, alphabet.symbols) for symbol in word]
        return ERASED if None in came else tuple([one for one in came if one is not None])


@dataclass(frozen=True)
class Faults:
    """Of both directions: (loss, flip, burst) each."""

    loss_up: float = 0.0
    loss_down: float = 0.0
    flip_up: float = 0.0
    flip_down: float = 0.0
    burst_up: tuple[float, float] = (0.0, 1.0)
    burst_down: tuple[float, float] = (0.0, 1.0)

    @classmethod
    def both(cls, loss: float = 0.0, flip: float = 0.0) -> Faults:
        return cls(loss, loss, flip, flip)

    def up(self, seed: int) -> Line:
        return Line(f"up {seed}", self.loss_up, self.flip_up, self.burst_up)

    def down(self, seed: int) -> Line:
        return Line(f"down {seed}", self.loss_down, self.flip_down, self.burst_down)


CLEAN = Faults()
