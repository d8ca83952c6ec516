"""Which down symbols are command symbols, and what line a layout needs."""

from __future__ import annotations

import pytest

from channel.codec.downlink.layout import Layout


def test_with_two_symbols_a_sample_each_sample_has_a_command_and_a_hash_symbol() -> None:
    layout = Layout(2)
    assert [layout.commands_in(sample, 0) for sample in range(4)] == [1, 1, 1, 1]
    assert layout.commands_in(7, 3) == 1


def test_with_a_period_idle_samples_are_all_hash_symbols_and_words_are_not_slowed() -> None:
    layout = Layout(4, 2, 3)
    assert [layout.commands_in(sample, 0) for sample in range(5)] == [2, 0, 0, 2, 0]
    assert [layout.commands_in(sample, sample) for sample in range(1, 4)] == [2, 2, 2]
    assert layout.word_samples(11) == 6


def test_with_one_symbol_a_sample_word_and_hash_symbols_alternate() -> None:
    layout = Layout(1, 1, 8)
    assert [sample for sample in range(20) if layout.commands_in(sample, 0)] == [0, 8, 16]
    assert [layout.commands_in(9, age) for age in range(1, 7)] == [0, 1, 0, 1, 0, 1]
    assert layout.word_samples(10) == 19


@pytest.mark.parametrize(
    "numbers", [(0,), (33,), (1,), (1, 1, 1), (2, 2), (2, 2, 4), (2, 0), (2, 1, 0)]
)
def test_a_layout_without_hash_or_command_symbols_is_refused(numbers: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match="symbol"):
        Layout(*numbers)


def test_a_line_too_slow_for_a_layout_is_refused_with_the_numbers() -> None:
    Layout(2).check_rate(20.0, 100_000_000)
    with pytest.raises(
        ValueError, match=r"ask for 20 symbols/s.*downlink_baud = 19.*at most 1 a sample"
    ):
        Layout(2).check_rate(19.0, 100_000_000)
