"""The memoryless coder (16): cells, their middles, and what lies outside."""

from __future__ import annotations

import math

import pytest

from channel.codec.codec import ERASED
from channel.codec.coders.static import StaticCoder, StaticParameters, number_of, write_bits


@pytest.mark.parametrize("bits", [1, 2, 3, 8, 15])
def test_when_an_angle_is_within_the_range_then_the_middle_is_half_a_cell_away_at_most(
    bits: int,
) -> None:
    coder = StaticCoder(StaticParameters(bits, 2.0, ((1.0,), (0.0,)), impulse=True))
    half = 2.0 / 2**bits
    assert coder.ranges(()) == (half,)
    for index in range(400):
        angle = -1.999 + 3.998 * index / 399
        word = coder.encode((), (0.0,), (angle,))
        (correction, _), _ = coder.decode((), (0.0, 0.0), word)
        assert abs(correction - angle) <= half * (1.0 + 1e-12)


def test_when_there_is_one_bit_then_it_is_the_sign_of_the_angle_itself() -> None:
    coder = StaticCoder(StaticParameters(1, math.pi, ((1.0,), (2.0,))))
    for angle, middle in ((0.1, math.pi / 2), (0.0, math.pi / 2), (-0.1, -math.pi / 2)):
        word = coder.encode((), (1.0,), (angle,))
        correction, _ = coder.decode((), (0.25, 0.0), word)
        assert correction == pytest.approx((middle - 0.25, 2.0 * (middle - 0.25)))


def test_when_the_angle_is_beyond_the_range_then_the_outermost_cell_is_sent() -> None:
    coder = StaticCoder(StaticParameters(3, 1.0))
    assert coder.encode((), (0.0,), (50.0,)) == (1, 1, 1)
    assert coder.encode((), (0.0,), (-50.0,)) == (0, 0, 0)


def test_when_the_word_is_erased_then_nothing_is_corrected() -> None:
    assert StaticCoder(StaticParameters()).decode((), (0.3, 0.0), ERASED) == ((0.0, 0.0), ())


def test_when_numbers_become_bits_then_they_come_back() -> None:
    five, three = [0] * 5, [0] * 3
    for number in range(32):
        write_bits(number, five)
        assert number_of(five) == number
    write_bits(2, three)
    assert three == [0, 1, 0], "the most significant symbol is the first"


@pytest.mark.parametrize(
    ("parameters", "text"),
    [
        (StaticParameters(bits=0), "bits must be"),
        (StaticParameters(range=0.0), "range must be"),
        (StaticParameters(gains=((1.0, 1.0),)), "one measured axis"),
    ],
)
def test_when_parameters_make_no_coder_then_they_are_refused(
    parameters: StaticParameters, text: str
) -> None:
    with pytest.raises(ValueError, match=text):
        StaticCoder(parameters)
