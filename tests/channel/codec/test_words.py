"""Alphabets and the numbering of words."""

from __future__ import annotations

from itertools import product

import pytest

from channel.codec.codec import ERASED, WIRE_ERASED, Alphabet, Word


@pytest.mark.parametrize(
    ("symbols", "length"),
    [((-1, 1), 1), ((-1, 1), 2), ((-1, 0, 1), 3), ((7, 3, 5), 4), ((0, 1), 15)],
)
def test_when_every_word_is_numbered_then_numbers_are_a_bijection(
    symbols: tuple[int, ...], length: int
) -> None:
    alphabet = Alphabet(symbols, length)
    words = list(product(symbols, repeat=length))
    numbers = [alphabet.word_number(word) for word in words]
    assert sorted(numbers) == list(range(len(symbols) ** length))
    assert [alphabet.word(number) for number in numbers] == words


def test_when_a_word_is_numbered_then_its_first_symbol_is_the_least_digit() -> None:
    alphabet = Alphabet((-1, 1), 3)
    assert alphabet.word_number((1, -1, -1)) == 1
    assert alphabet.word_number((-1, -1, 1)) == 4


def test_when_a_word_is_erased_then_its_number_is_its_own() -> None:
    alphabet = Alphabet((-1, 1), 15)
    assert alphabet.word_number(ERASED) == WIRE_ERASED
    assert alphabet.word(WIRE_ERASED) is ERASED


def test_when_silence_is_a_symbol_then_it_is_no_erasure() -> None:
    alphabet = Alphabet((-1, 0, 1), 1)
    assert alphabet.word_number((0,)) != alphabet.word_number(ERASED)


def test_when_symbols_are_numbered_then_foreign_numbers_have_no_symbol() -> None:
    alphabet = Alphabet((-1, 1), 1)
    assert [alphabet.symbol_number(symbol) for symbol in (-1, 1)] == [0, 1]
    assert [alphabet.symbol(number) for number in (-1, 0, 1, 2, 255)] == [None, -1, 1, None, None]


@pytest.mark.parametrize(
    ("symbols", "length", "text"),
    [
        ((), 1, "distinct symbols"),
        ((1,), 1, "distinct symbols"),
        ((1, 1), 1, "distinct symbols"),
        ((-1, 1), 0, "at least one symbol"),
        ((-1, 1), -1, "at least one symbol"),
        ((-1, 1), 16, "make 65536 words"),
    ],
)
def test_when_an_alphabet_makes_no_words_then_it_is_refused(
    symbols: tuple[int, ...], length: int, text: str
) -> None:
    with pytest.raises(ValueError, match=text):
        Alphabet(symbols, length)


def test_when_there_are_exactly_as_many_words_as_numbers_then_the_alphabet_stands() -> None:
    alphabet = Alphabet(tuple(range(255)), 2)
    assert alphabet.word(255 * 255 - 1) == (254, 254)


def test_when_there_are_more_symbols_than_a_frame_numbers_then_the_alphabet_is_refused() -> None:
    with pytest.raises(ValueError):
        Alphabet(tuple(range(257)), 1)


@pytest.mark.parametrize("word", [(), (1,), (1, 1, 1), (1, 0), (2, 1)])
def test_when_a_word_is_foreign_then_it_has_no_number(word: Word) -> None:
    with pytest.raises(ValueError):
        Alphabet((-1, 1), 2).word_number(word)


@pytest.mark.parametrize("number", [-1, 4, 5, 0xFFFE])
def test_when_a_number_is_foreign_then_it_has_no_word(number: int) -> None:
    with pytest.raises(ValueError, match=r"outside 0 \.\.\. 3"):
        Alphabet((-1, 1), 2).word(number)
