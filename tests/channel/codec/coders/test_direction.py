"""The direction coder: what a sign is about, what follows from it, and its limits."""

from __future__ import annotations

import math
import random
from dataclasses import replace

import pytest

from channel.codec.codec import ERASED, Vector
from channel.codec.coders.direction import GROWTH_MAX, DirectionCoder, DirectionParameters, aim
from channel.codec.coders.symmetric import place
from tests.golden.regenerate import AERO_DIRECTION, PITCH_DIRECTION

ZERO = (0.0, 0.0)
NOTHING = (0.0,) * 4
AXES = [(1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0)]


def follow(coder: DirectionCoder, samples: int, strength: float, seed: int = 4) -> tuple[float, Vector]:
    """Return the rms of the angle just after the bits under noise of a strength, and the last state."""
    chooser = random.Random(seed)
    (f00, f01), (f10, f11) = coder.parameters.transition
    (q00, q01), (_, q11) = coder.parameters.noise
    low00 = math.sqrt(q00)
    low10 = q01 / low00
    low11 = math.sqrt(q11 - low10 * low10)
    angle = rate = total = 0.0
    state = coder.initial()
    for sample in range(samples):
        word = coder.encode(state, ZERO, (angle, rate))
        (jump, kick), state = coder.decode(state, ZERO, word)
        angle, rate = angle - jump, rate - kick
        total += angle * angle if sample >= samples // 2 else 0.0
        one, other = (strength * chooser.gauss(0.0, 1.0) for _ in range(2))
        angle, rate = (
            f00 * angle + f01 * rate + low00 * one,
            f10 * angle + f11 * rate + low10 * one + low11 * other,
        )
    return math.sqrt(total / (samples - samples // 2)), state


def test_when_the_disturbance_is_as_assumed_then_the_error_is_what_the_coder_believes() -> None:
    coder = DirectionCoder(replace(PITCH_DIRECTION, adapts=False, step=1.0, removed=0.67))
    rms, state = follow(coder, 4000, 1.0)
    assert state[-1] == 1.0
    # Before a bit; after it, about half of the variance is gone.
    assert 0.4 < rms / coder.ranges(state)[0] < 1.0


@pytest.mark.parametrize("strength", [0.1, 10.0])
def test_when_the_disturbance_is_another_then_its_strength_is_found(strength: float) -> None:
    coder = DirectionCoder(replace(PITCH_DIRECTION, step=1.0, removed=0.67))
    known, _ = follow(coder, 6000, 1.0)
    rms, state = follow(coder, 6000, strength)
    assert 0.4 * strength < state[-1] < 2.5 * strength
    assert rms / strength == pytest.approx(known, rel=0.15)


def test_when_a_direction_is_aimed_at_then_it_is_the_top_eigenvector() -> None:
    coder = DirectionCoder(AERO_DIRECTION)
    state = list(coder.initial())
    c, v = [0.0] * 4, [0.0] * 4
    assert aim(coder.constants, state, c, v)
    # All of it is about one axis: nothing couples the two covariances.
    assert c[2:] == [0.0, 0.0]
    assert sum(a * b for a, b in zip(c, v, strict=True)) == pytest.approx(1.0, abs=1e-12)
    image = [
        sum(AERO_DIRECTION.worth[row][column] * v[column] for column in range(4)) for row in range(2)
    ]
    assert image[0] / image[1] == pytest.approx(c[0] / c[1], rel=1e-3)


def test_a_sign_is_about_the_output_whose_error_correlates_most_with_what_is_asked() -> None:
    coder = DirectionCoder(AERO_DIRECTION, AXES)
    swapped = DirectionCoder(AERO_DIRECTION, AXES[::-1])
    state, counts = coder.initial(), [0, 0]
    c, v = [0.0] * 4, [0.0] * 4
    assert aim(coder.constants, list(state), c, v)
    # Nothing couples the two axes yet, so that the direction is all within one.
    assert coder.about(state, (1, -1), NOTHING) == ((0, 1) if c[2:] == [0.0, 0.0] else (1, 0))
    for _ in range(50):
        first, second = coder.about(state, (1, -1), NOTHING)
        assert swapped.about(state, (1, -1), NOTHING) == (1 - first, 1 - second)
        counts[first] += 1
        counts[second] += 1
        _, state = coder.decode(state, (0.0,) * 4, (1, -1))
    assert min(counts) > 10


def test_one_sign_is_about_the_same_output_as_the_first_of_two() -> None:
    two = DirectionCoder(AERO_DIRECTION, AXES)
    one = DirectionCoder(replace(AERO_DIRECTION, bits=1), AXES)
    state = two.initial()
    for sample in range(20):
        sign = 1 if sample % 4 < 2 else -1
        correction, after = one.decode(state, NOTHING, (sign,))
        assert one.about(state, (sign,), correction) == two.about(state, (sign, 1), NOTHING)[:1]
        state = after


def test_ranges_are_of_outputs_that_may_be_sums_of_states() -> None:
    coder = DirectionCoder(AERO_DIRECTION)
    total = DirectionCoder(AERO_DIRECTION, [(1.0, 0.0, -2.0, 0.0)])
    angle, _, other, _ = coder.ranges(coder.initial())
    assert total.ranges(coder.initial())[0] == pytest.approx(math.hypot(angle, 2.0 * other))


def test_when_two_signs_are_sent_then_the_second_is_about_what_the_first_has_left() -> None:
    coder = DirectionCoder(AERO_DIRECTION)
    zero = (0.0,) * 4
    first, _ = coder.decode(coder.initial(), zero, (1, 1))
    other, _ = coder.decode(coder.initial(), zero, (1, -1))
    assert first[:2] == other[:2]
    assert first[2] == -other[2] > 0.0
    assert coder.encode(coder.initial(), zero, (1e-3, 0.0, -1e-3, 0.0)) == (1, -1)


def test_when_words_are_opposite_then_corrections_are() -> None:
    coder = DirectionCoder(PITCH_DIRECTION)
    (up, down) = (coder.decode(coder.initial(), ZERO, (sign,)) for sign in (1, -1))
    assert up[0] == tuple(-value for value in down[0])
    assert coder.encode(coder.initial(), (0.3, 0.1), (0.3, 0.1)) == (1,), "the sign of zero is +1"


def test_when_a_word_is_erased_then_only_doubt_grows() -> None:
    coder = DirectionCoder(PITCH_DIRECTION)
    _, before = follow(coder, 50, 1.0)
    correction, after = coder.decode(before, ZERO, ERASED)
    assert correction == ZERO
    assert after[-2:] == before[-2:]
    assert coder.ranges(after)[0] > coder.ranges(before)[0]


def test_when_nothing_arrives_for_hours_then_the_state_stays_finite_and_recovers() -> None:
    unstable = replace(PITCH_DIRECTION, transition=((1.27, 0.109), (5.86, 1.27)))
    coder = DirectionCoder(unstable)
    _, state = follow(coder, 20, 1.0)
    for _ in range(20_000):
        _, state = coder.decode(state, ZERO, ERASED)
        assert coder.is_state(state)
    assert state[0] <= GROWTH_MAX * unstable.start[0][0] * 1.0001
    correction, state = coder.decode(state, ZERO, (1,))
    assert all(map(math.isfinite, (*correction, *state)))


def test_when_the_functions_write_into_old_results_then_nothing_of_them_is_left() -> None:
    coder = DirectionCoder(AERO_DIRECTION)
    chooser = random.Random(8)
    state = coder.initial()
    zero = (0.0,) * 4
    for _ in range(50):
        word = coder.encode(state, zero, tuple(chooser.uniform(-0.01, 0.01) for _ in zero))
        erased = chooser.random() < 0.2
        correction = [chooser.random() for _ in zero]
        after = [chooser.random() for _ in state]
        symbols = (0, 0) if erased else word
        coder.functions.decode(coder.constants, state, zero, symbols, erased, correction, after)
        expected = coder.decode(state, zero, ERASED if erased else word)
        assert (tuple(correction), tuple(after)) == expected
        state = expected[1]


def test_when_a_state_comes_over_a_line_then_impossible_ones_are_refused() -> None:
    coder = DirectionCoder(PITCH_DIRECTION)
    good = coder.initial()
    assert coder.is_state(good)
    assert not coder.is_state((-1e-9, *good[1:]))
    assert not coder.is_state((*good[:-1], 0.0))
    assert not coder.is_state((1e30, *good[1:]))
    # One whose covariance is no covariance is no direction to ask for, and no error either.
    impossible = (*good[: place(1, 0)], 1.0, *good[place(1, 0) + 1 :])
    assert all(map(math.isfinite, coder.decode(impossible, ZERO, (1,))[0]))


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"bits": 0}, "bits must be"),
        ({"removed": 1.0}, "removed must be"),
        ({"initial_strength": 0.0}, "strengths must be"),
        ({"noise": ((1.0,),)}, "noise has 1 rows"),
        ({"worth": ((1.0, 0.5), (0.4, 1.0))}, "worth must be symmetric, and its entries 2, 1 differ"),
        ({"start": ((1.0, 0.0), (0.0, 0.0))}, "start must be above 0 on its diagonal, state 2"),
    ],
)
def test_when_parameters_make_no_coder_then_they_are_refused(changes, text: str) -> None:  # type: ignore[no-untyped-def]
    parameters: DirectionParameters = replace(PITCH_DIRECTION, **changes)
    with pytest.raises(ValueError, match=text):
        DirectionCoder(parameters)
