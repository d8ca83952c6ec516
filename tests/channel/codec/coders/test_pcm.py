"""The usual loop's coder: words of an encoder's angle, and the differentiator behind them."""

from __future__ import annotations

import math

import pytest

from channel.codec.codec import ERASED, Codec
from channel.codec.coders.pcm import PcmCoder, PcmParameters
from channel.codec.models.hold import HoldModel

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


def test_when_there_are_three_angles_then_they_have_their_words_in_turn() -> None:
    model = HoldModel(0.01, outputs=("travel", "elevation", "pitch"))
    parts = Codec(model, PcmCoder(PcmParameters(angles=3)), 1)
    state = parts.initial()
    for sample in range(9):
        measured = (sample * STEP, -2 * sample * STEP, 5 * STEP)
        word = parts.encode(state, measured)
        if sample == 4:
            word = ERASED  # type: ignore[assignment]
        assert parts.about(state, word, parts.open(state, word).model) in (None, (sample % 3,) * 10)
        assert parts.coder.is_state(state.coder)  # type: ignore[attr-defined]
        state = parts.step(state, word, NOTHING)
    seen = (6 * STEP, -14 * STEP, 5 * STEP)
    # The elevation's second word was erased: its difference spans six samples.
    rates = (3 * STEP / 0.03, -12 * STEP / 0.06, 0.0)
    assert state.model == pytest.approx((*seen, *rates), abs=1e-9)
    broken = (*state.coder[:-1], 3.0)
    assert not parts.coder.is_state(broken)  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    "parameters",
    [PcmParameters(bits=16), PcmParameters(range=0.0), PcmParameters(rate_filter_s=-1.0)],
)
def test_when_parameters_make_no_coder_then_they_are_refused(parameters: PcmParameters) -> None:
    with pytest.raises(ValueError, match="must be"):
        PcmCoder(parameters)
