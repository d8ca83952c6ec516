"""The paper's coder against its equations (16)-(22), written out once more and differently."""

from __future__ import annotations

import itertools
import random
from collections.abc import Iterable

import pytest

from channel.codec.codec import ERASED, Word
from channel.codec.coders.zoom import ZoomCoder, ZoomParameters

SEED = 20240612
NUMBERS = {"initial_range": 0.5, "minimum_range": 0.05, "decay": 0.95}


def ranges_of_the_paper(signs: Iterable[int], window: int) -> list[float]:
    """Return M_0, M_1, ... by (19): lambda is the mean of the last `window` signs, zeros before."""
    rho, minimum = NUMBERS["decay"], NUMBERS["minimum_range"]
    ranges = [NUMBERS["initial_range"]]
    heard = [0] * window
    for sign in signs:
        heard = [*heard[1:], sign]
        mean = sum(heard) / window
        scaled = rho * ranges[-1] if abs(mean) <= 0.5 else ranges[-1] / rho
        ranges.append((1.0 - rho) * minimum + scaled)
    return ranges


def ranges_of_the_coder(coder: ZoomCoder, words: Iterable[Word]) -> list[float]:
    state = coder.initial()
    ranges = [coder.ranges(state)[0]]
    for word in words:
        _, state = coder.decode(state, (), word)
        ranges.append(coder.ranges(state)[0])
    return ranges


@pytest.mark.parametrize("window", [1, 2, 3, 4, 5])
@pytest.mark.parametrize("erased_share", [0.0, 0.3])
def test_when_words_come_or_are_erased_then_the_range_follows_the_paper(
    window: int, erased_share: float
) -> None:
    chooser = random.Random(SEED + window)
    signs = []
    for _ in range(500):
        # Runs of equal signs, so that the range grows as often as it shrinks.
        sign = signs[-1] if signs and signs[-1] and chooser.random() < 0.7 else chooser.choice((-1, 1))
        signs.append(0 if chooser.random() < erased_share else sign)
    words: list[Word] = [(sign,) if sign else ERASED for sign in signs]
    ours = ranges_of_the_coder(ZoomCoder(ZoomParameters(window=window)), words)
    assert ours == pytest.approx(ranges_of_the_paper(signs, window), rel=1e-13)
    if window > 1:
        rises = sum(later > earlier for earlier, later in itertools.pairwise(ours))
        assert 25 < rises < 475, "the signs exercise one branch of (19) only"


@pytest.mark.parametrize(
    ("window", "signs", "grows"),
    [
        (2, (1, 1), True),
        (2, (-1, -1), True),
        (2, (1, -1), False),
        (2, (0, 1), False),  # |lambda| = 0.5 is not saturated
        (2, (1, 0), False),
        (3, (1, 1, 1), True),
        (3, (1, 1, -1), False),
        (3, (1, 0, 1), True),  # 2/3
        (3, (0, 0, 1), False),
        (3, (-1, -1, -1), True),
        (4, (1, 1, 1, -1), False),  # exactly one half
        (4, (1, 1, 1, 0), True),
    ],
)
def test_when_the_last_signs_are_given_then_the_range_grows_or_shrinks(
    window: int, signs: tuple[int, ...], grows: bool
) -> None:
    words: list[Word] = [(sign,) if sign else ERASED for sign in signs]
    ranges = ranges_of_the_coder(ZoomCoder(ZoomParameters(window=window)), words)
    assert (ranges[-1] > ranges[-2]) is grows


def test_when_the_range_decays_for_long_then_it_rests_at_its_minimum() -> None:
    words: list[Word] = [(1,), (-1,)] * 500
    assert ranges_of_the_coder(ZoomCoder(ZoomParameters()), words)[-1] == pytest.approx(0.05, rel=1e-9)


def test_when_signs_come_then_the_central_number_moves_by_one_range_each() -> None:
    """(17), (18): with the gain 1 as an impulse, the model state is the central number."""
    chooser = random.Random(SEED)
    coder = ZoomCoder(ZoomParameters(gains=((1.0,),), impulse=True))
    state, centre, level = coder.initial(), 0.0, 0.0
    signs: list[int] = []
    for _ in range(300):
        level += chooser.uniform(-0.05, 0.08)
        (sign,) = coder.encode(state, (centre,), (level,))
        assert sign == (1 if level - centre >= 0.0 else -1)
        correction, state = coder.decode(state, (centre,), (sign,))
        expected = ranges_of_the_paper(signs, 2)[-1] * sign
        assert correction == (pytest.approx(expected, rel=1e-13),)
        signs.append(sign)
        centre += correction[0]
    assert abs(level - centre) < 0.3


@pytest.mark.parametrize("sign", [-1, 1])
def test_when_a_sign_comes_then_each_gain_multiplies_the_range_before_it(sign: int) -> None:
    coder = ZoomCoder(ZoomParameters())
    correction, _ = coder.decode((0.2, 1.0), (), (sign,))
    assert correction == (4.1 * (0.2 * sign), 8.6 * (0.2 * sign))


def test_when_there_are_two_axes_then_each_has_its_own_range_and_history() -> None:
    both = ZoomCoder(ZoomParameters(window=3, gains=((1.0, 0.0), (0.0, 2.0), (0.5, 0.25))))
    chooser = random.Random(SEED)
    words = [(chooser.choice((-1, 1)), chooser.choice((-1, -1, 1))) for _ in range(200)]
    state = both.initial()
    for index, word in enumerate(words):
        first = ranges_of_the_paper((pair[0] for pair in words[:index]), 3)[-1]
        second = ranges_of_the_paper((pair[1] for pair in words[:index]), 3)[-1]
        assert both.ranges(state) == pytest.approx((first, second), rel=1e-13)
        a, b = word[0] * first, word[1] * second
        correction, state = both.decode(state, (), word)
        assert correction == pytest.approx((a, 2.0 * b, 0.5 * a + 0.25 * b), rel=1e-12)


@pytest.mark.parametrize(
    ("parameters", "text"),
    [
        (ZoomParameters(gains=()), "gains"),
        (ZoomParameters(gains=((),)), "gains"),
        (ZoomParameters(gains=((1.0,), (1.0, 2.0))), "gains"),
        (ZoomParameters(decay=0.0), "decay must be in"),
        (ZoomParameters(decay=1.1), "decay must be in"),
        (ZoomParameters(decay=float("nan")), "decay must be in"),
        (ZoomParameters(window=0), "window must be at least 1"),
    ],
)
def test_when_parameters_make_no_coder_then_they_are_refused_by_name(
    parameters: ZoomParameters, text: str
) -> None:
    with pytest.raises(ValueError, match=text):
        ZoomCoder(parameters)
