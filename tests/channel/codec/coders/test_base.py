"""Coders as functions: what the compiled studies call gives what the codec is given."""

from __future__ import annotations

import random

import pytest

from channel.codec.codec import ERASED, Coder
from channel.codec.coders.base import FunctionCoder
from channel.codec.coders.open_loop_zoom import OpenLoopZoomCoder, OpenLoopZoomParameters
from channel.codec.coders.pcm import PcmCoder, PcmParameters
from channel.codec.coders.static import StaticCoder, StaticParameters
from channel.codec.coders.zoom import ZoomCoder, ZoomParameters

CODERS = (
    ZoomCoder(ZoomParameters(window=4)),
    OpenLoopZoomCoder(OpenLoopZoomParameters()),
    StaticCoder(StaticParameters(bits=3)),
    PcmCoder(PcmParameters(rate_filter_s=0.03)),
)


@pytest.mark.parametrize("coder", CODERS, ids=lambda coder: type(coder).__name__)
def test_when_the_functions_write_into_old_results_then_nothing_of_them_is_left(
    coder: FunctionCoder,
) -> None:
    """Arrays are used again from sample to sample: every entry must be written every time."""
    full: Coder = coder  # type: ignore[assignment]
    chooser = random.Random(8)
    state = full.initial()
    for _ in range(100):
        model = (chooser.uniform(-1.0, 1.0), chooser.uniform(-1.0, 1.0))
        word = full.encode(state, model[:1], (chooser.uniform(-1.0, 1.0),))
        erased = chooser.random() < 0.2
        correction = [chooser.random() for _ in range(coder.correction_size)]
        after = [chooser.random() for _ in state]
        symbols = (0,) * len(word) if erased else word
        coder.functions.decode(coder.constants, state, model, symbols, erased, correction, after)
        expected = full.decode(state, model, ERASED if erased else word)
        assert (tuple(correction), tuple(after)) == expected
        state = expected[1]
