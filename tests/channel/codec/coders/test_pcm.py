"""The usual loop's coder: words of an encoder's angle, and the differentiator behind them."""

from __future__ import annotations

import math

import pytest

from channel.codec.codec import Codec
from channel.codec.coders.pcm import PcmCoder, PcmParameters
from channel.codec.models.hold import HoldModel
from channel.codec.words import ERASED

STEP = math.tau / 1024
NOTHING = [(0.0, 0.0)]


def codec(rate_filter_s: float = 0.0) -> Codec:
    return Codec(HoldModel(0.01), PcmCoder(PcmParameters(rate_filter_s=rate_filter_s)), 1)


def test_when_a_ten_bit_encoder_is_read_then_the_word_says_its_angle_exactly() -> None:
    parts = codec()
    for count in (-512, -511, -1, 0, 1, 300, 511):
        state = parts.initial()
        state = parts.step(state, parts.encode(state, (count * STEP,)), NOTHING)
        assert state.model[0] == pytest.approx(count * STEP, abs=1e-12)


def test_when_the_angle_moves_then_the_rate_is_the_difference_over_the_period() -> None:
    parts = codec()
    state = parts.initial()
    for count, rate in ((5, 0.0), (5, 0.0), (7, 200.0), (4, -300.0)):
        state = parts.step(state, parts.encode(state, (count * STEP,)), NOTHING)
        assert state.model[1] == pytest.approx(rate * STEP, abs=1e-9)


def test_when_words_are_erased_then_the_next_difference_spans_the_gap() -> None:
    parts = codec()
    state = parts.initial()
    state = parts.step(state, parts.encode(state, (0.0,)), NOTHING)
    for _ in range(3):
        before = state.model
        state = parts.step(state, ERASED, NOTHING)
        assert state.model == before
    state = parts.step(state, parts.encode(state, (8 * STEP,)), NOTHING)
    assert state.model == pytest.approx((8 * STEP, 200.0 * STEP))


def test_when_the_differentiator_is_filtered_then_a_steady_rate_is_reached_in_its_time() -> None:
    parts = codec(rate_filter_s=0.09)
    state = parts.initial()
    for tick in range(40):
        state = parts.step(state, parts.encode(state, (tick * STEP,)), NOTHING)
        left = 0.9**tick
        assert state.model[1] == pytest.approx(100.0 * STEP * (1.0 - left), rel=1e-6, abs=1e-9)


@pytest.mark.parametrize(
    "parameters",
    [PcmParameters(bits=16), PcmParameters(range=0.0), PcmParameters(rate_filter_s=-1.0)],
)
def test_when_parameters_make_no_coder_then_they_are_refused(parameters: PcmParameters) -> None:
    with pytest.raises(ValueError, match="must be"):
        PcmCoder(parameters)
