"""Time-based zooming and the fixed range: the range follows the clock and nothing else."""

from __future__ import annotations

import pytest

from channel.codec.codec import ERASED, Word
from channel.codec.coders.open_loop_zoom import OpenLoopZoomCoder, OpenLoopZoomParameters
from channel.codec.coders.zoom import ZoomCoder, ZoomParameters


@pytest.mark.parametrize("words", [[(1,)] * 30, [(-1,), (1,)] * 15, [ERASED] * 30])
def test_when_any_words_come_then_the_range_is_that_of_the_formula(words: list[Word]) -> None:
    coder = OpenLoopZoomCoder(OpenLoopZoomParameters(0.5, 0.05, 0.9))
    state = coder.initial()
    for index, word in enumerate(words):
        expected = 0.05 + (0.5 - 0.05) * 0.9**index
        assert coder.ranges(state) == pytest.approx((expected,), rel=1e-12)
        correction, state = coder.decode(state, (), word)
        sign = word[0] if word is not None else 0
        assert correction == pytest.approx((4.1 * expected * sign, 8.6 * expected * sign))


def test_when_nothing_decays_then_the_range_stays_to_the_last_bit() -> None:
    coder = OpenLoopZoomCoder(OpenLoopZoomParameters(0.1, 0.1, 1.0))
    state = coder.initial()
    for _ in range(100):
        _, state = coder.decode(state, (), (1,))
    assert state == (0.1,)


def test_when_the_signs_are_asked_for_then_they_are_those_of_the_papers_coder() -> None:
    timed, zoom = OpenLoopZoomCoder(OpenLoopZoomParameters()), ZoomCoder(ZoomParameters())
    for measured, predicted in ((0.1, 0.2), (0.2, 0.1), (0.0, 0.0), (-1.0, -1.0)):
        arguments = ((predicted,), (measured,))
        assert timed.encode(timed.initial(), *arguments) == zoom.encode(zoom.initial(), *arguments)


@pytest.mark.parametrize(
    ("parameters", "text"),
    [
        (OpenLoopZoomParameters(gains=()), "gains"),
        (OpenLoopZoomParameters(decay=0.0), "decay must be in"),
    ],
)
def test_when_parameters_make_no_coder_then_they_are_refused(
    parameters: OpenLoopZoomParameters, text: str
) -> None:
    with pytest.raises(ValueError, match=text):
        OpenLoopZoomCoder(parameters)
