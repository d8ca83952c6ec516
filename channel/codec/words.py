"""Symbols, words and erasures.

A coder declares an alphabet (for the paper: -1 and +1) and how many symbols make the *word* of one
sample. What the codec consumes for a sample is either a word or `ERASED`: the receiver saw no whole
word in time. An erasure is distinct from every symbol, a paid silence included.
"""

from __future__ import annotations

from typing import Final, TypeAlias

Word: TypeAlias = tuple[int, ...] | None
"""One sample's symbols in the order in which they were sent, or `ERASED`."""

ERASED: Final = None
"""No whole word arrived in time."""

WIRE_ERASED: Final = 0xFFFF
"""An erasure as a frame carries it; word numbers stay below."""


SYMBOLS_MAX: Final = 256
"""A frame has one byte for a symbol."""


class Alphabet:
    """The symbols of a coder, and the numbering of its words on the wire.

    A word of `b` symbols from an alphabet of `A` has a number in `0 ... A**b - 1`, its first symbol
    the least significant digit.
    """

    def __init__(self, symbols: tuple[int, ...], symbols_per_word: int) -> None:
        if not 2 <= len(symbols) <= SYMBOLS_MAX or len(set(symbols)) != len(symbols):
            raise ValueError(
                f"an alphabet needs 2 to {SYMBOLS_MAX} distinct symbols, got {len(symbols)}"
            )
        words = 1
        for _ in range(symbols_per_word):
            words *= len(symbols)
        if symbols_per_word < 1 or words > WIRE_ERASED:
            raise ValueError(
                f"{symbols_per_word} symbols of {len(symbols)} kinds make {words} words; "
                f"a word must have at least one symbol and at most {WIRE_ERASED} kinds of words"
            )
        self.symbols = symbols
        self.symbols_per_word = symbols_per_word
        self._digit = {symbol: digit for digit, symbol in enumerate(symbols)}
        self._words = words

    def symbol_number(self, symbol: int) -> int:
        """Return the digit that stands for one symbol; ValueError for a foreign one."""
        if symbol not in self._digit:
            raise ValueError(f"symbol {symbol} is not in the alphabet {self.symbols}")
        return self._digit[symbol]

    def symbol(self, number: int) -> int | None:
        return self.symbols[number] if 0 <= number < len(self.symbols) else None

    def word_number(self, word: Word) -> int:
        """Return the wire number of a word, `WIRE_ERASED` for an erasure."""
        if word is ERASED:
            return WIRE_ERASED
        if len(word) != self.symbols_per_word:
            raise ValueError(f"a word has {self.symbols_per_word} symbols, got {word}")
        number = 0
        for symbol in reversed(word):
            number = number * len(self.symbols) + self.symbol_number(symbol)
        return number

    def has_word(self, number: int) -> bool:
        return 0 <= number < self._words or number == WIRE_ERASED

    def word(self, number: int) -> Word:
        """Return the word with this wire number; ValueError when there is none."""
        if number == WIRE_ERASED:
            return ERASED
        if not 0 <= number < self._words:
            raise ValueError(f"word number {number} is outside 0 ... {self._words - 1}")
        digits = []
        for _ in range(self.symbols_per_word):
            number, digit = divmod(number, len(self.symbols))  # integers
            digits.append(self.symbols[digit])
        return tuple(digits)
