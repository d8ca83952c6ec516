"""The history coder: what a sign means, how it is chosen, and the same bits when it is compiled."""

from __future__ import annotations

import math
import random
from itertools import product

import pytest

from channel.codec.codec import ERASED
from channel.codec.coders.history import (
    HistoryCoder,
    HistoryParameters,
    history_decode,
    history_encode,
)
from tenbaud.studies.compiled import compiled

ROWS = ((0.5, 0.3, 0.6), (0.7, 0.9, 1.1), (0.4, 1.1, 0.7), (1.2, 1.0, 1.5))
FLOOR = {"floor_gain": 0.1, "floor_exponent": 0.3}


def coder_of(rows=ROWS, lookahead: int = 1, **changes) -> HistoryCoder:  # type: ignore[no-untyped-def]
    values = {"initial_range": 0.1, "minimum_range": 0.02, "maximum_range": 0.4, "period_s": 0.1}
    return HistoryCoder(HistoryParameters(rows=rows, lookahead=lookahead, **(values | changes)))


def test_when_a_sign_repeats_then_its_row_says_so_whichever_sign_it_is() -> None:
    coder = coder_of()
    for sign, history in ((1, 3.0), (-1, 0.0)):
        correction, after = coder.decode((0.1, history), (), (sign,))
        assert correction == pytest.approx((sign * 0.1 * 1.2, sign * 0.1 * 1.0 / 0.1))
        assert after == (pytest.approx(0.15), history)


def test_when_a_sign_turns_then_the_range_shrinks_and_the_history_shifts() -> None:
    correction, after = coder_of().decode((0.1, 3.0), (), (-1,))
    assert correction == pytest.approx((-0.1 * 0.5, -0.1 * 0.3 / 0.1))
    assert after == (pytest.approx(0.06), 2.0)


def test_when_signs_run_on_then_the_range_stays_within_its_limits() -> None:
    coder = coder_of()
    state = coder.initial()
    for _ in range(30):
        _, state = coder.decode(state, (), (1,))
    assert state[0] == 0.4
    for sample in range(60):
        _, state = coder.decode(state, (), (1 if sample % 2 else -1,))
    assert state[0] == 0.02


def test_when_a_word_is_erased_then_nothing_is_corrected_and_nothing_forgotten() -> None:
    assert coder_of().decode((0.07, 2.0), (), ERASED) == ((0.0, 0.0), (0.07, 2.0))


def test_when_there_is_one_row_and_no_look_ahead_then_it_is_a_sign_test_of_a_combination() -> None:
    coder = coder_of(((1.4, 1.5, 1.0),), 0, weights=(1.0 / 1.4, 0.0, 1.46 / 1.5), minimum_range=0.1)
    chooser = random.Random(4)
    for _ in range(300):
        angle, rate = chooser.uniform(-0.3, 0.3), chooser.uniform(-3.0, 3.0)
        asked = 1 if angle + 1.46 * 0.1 * rate >= 0.0 else -1
        assert coder.encode((0.1, 0.0), (1.0, -2.0), (1.0 + angle, rate - 2.0)) == (asked,)


@pytest.mark.parametrize("lookahead", [1, 2, 4])
def test_when_every_sequence_of_signs_is_tried_then_none_beats_the_one_that_is_begun(
    lookahead: int,
) -> None:
    coder = coder_of(lookahead=lookahead)
    chooser = random.Random(5)
    both = set()
    for _ in range(60):
        state = (chooser.uniform(0.02, 0.4), float(chooser.randrange(4)))
        angle, rate = chooser.uniform(-0.4, 0.4), chooser.uniform(-3.0, 3.0)
        costs = {
            signs: cost_of(coder, state, angle, rate * 0.1, signs)
            for signs in product((1, -1), repeat=lookahead)
        }
        best = min(costs, key=lambda signs: costs[signs])
        word = coder.encode(state, (0.2, 0.1), (0.2 + angle, 0.1 + rate))
        assert word == (best[0],)
        both.add(word)
    assert both == {(1,), (-1,)}


def cost_of(coder, state, angle, rate, signs) -> float:  # type: ignore[no-untyped-def]
    """Follow one sequence of signs through `decode`, as the receiver would."""
    total = 0.0
    for sign in signs:
        correction, state = coder.decode(state, (), (sign,))
        angle -= correction[0]
        rate -= correction[1] * 0.1
        total += angle * angle + angle * rate + rate * rate / 3.0
        angle += rate
    aa, ar, rr = coder.parameters.weights
    return float(total + aa * angle * angle + 2.0 * ar * angle * rate + rr * rate * rate)


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"rows": ROWS[:3]}, "1, 2, 4"),
        ({"rows": ()}, "1, 2, 4"),
        ({"rows": ((1.0, 0.0, 1.0),)}, "row 0"),
        ({"minimum_range": 0.2}, "minimum <= initial"),
        ({"period_s": 0.0}, "period_s"),
        ({"lookahead": 7}, "lookahead"),
        ({"weights": (1.0, 2.0, 1.0)}, "never negative"),
        ({"floor_gain": 1.5}, "floor_gain"),
    ],
)
def test_when_parameters_make_no_coder_then_the_error_names_them(changes: dict, text: str) -> None:  # type: ignore[type-arg]
    with pytest.raises(ValueError, match=text):
        coder_of(**changes)


@pytest.mark.parametrize("floor", [{}, FLOOR], ids=["constant floor", "slow floor"])
def test_when_the_functions_are_compiled_then_every_bit_is_the_same(floor: dict) -> None:  # type: ignore[type-arg]
    numpy = pytest.importorskip("numpy")
    pytest.importorskip("numba")
    coder = coder_of(lookahead=2, **floor)
    chooser = random.Random(6)
    cases = []
    for _ in range(200):
        state = [chooser.uniform(0.02, 0.4), float(chooser.randrange(4)), chooser.uniform(0.0, 2.0)]
        seen = [chooser.uniform(-0.5, 0.5), chooser.uniform(-4.0, 4.0)]
        cases.append((numpy.array(state[: len(coder.initial())]), numpy.array(seen)))
    plain = [results(history_encode, history_decode, coder.constants, *case) for case in cases]
    ours = (compiled(history_encode), compiled(history_decode))
    assert [results(*ours, coder.constants, *case) for case in cases] == plain


def results(encode, decode, constants, coder, measurement):  # type: ignore[no-untyped-def]
    import numpy

    symbols = numpy.zeros(1, dtype=numpy.int64)
    encode(constants, coder, numpy.zeros(2), measurement, symbols)
    numbers = []
    for erased in (False, True):
        correction, after = numpy.zeros(2), numpy.zeros(len(coder))
        decode(constants, coder, numpy.zeros(4), symbols, erased, correction, after)
        numbers += [*correction.tolist(), *after.tolist()]
    return int(symbols[0]), [value.hex() for value in numbers]


def test_when_the_floor_has_no_gain_then_there_is_no_more_state() -> None:
    assert coder_of().initial() == (0.1, 1.0)
    assert coder_of(**FLOOR).initial() == (0.1, 1.0, 0.0)


def test_when_the_range_was_large_for_long_then_the_smallest_range_stays_up_for_a_while() -> None:
    coder = coder_of(**FLOOR)
    state = coder.initial()
    for _ in range(200):
        _, state = coder.decode(state, (), (1,))
    slow = state[2]
    assert slow == pytest.approx(math.log(0.4 / 0.02), rel=1e-6)
    assert coder.decode(state, (), ERASED)[1] == state
    for sample in range(8):
        before = state[2]
        _, state = coder.decode(state, (), (1 if sample % 2 else -1,))
        assert coder.is_state(state)
    # All ranges had time to shrink to 0.02; the floor holds this one.
    assert state[0] == pytest.approx(0.02 * math.exp(0.3 * before), rel=1e-12)
    assert 0.02 < state[0] < 0.05
    for sample in range(600):
        _, state = coder.decode(state, (), (1 if sample % 2 else -1,))
    assert coder.is_state(state)
    assert state[0] == pytest.approx(0.02, rel=1e-3)
