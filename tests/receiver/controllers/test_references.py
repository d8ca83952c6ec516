"""Reference angles tick by tick."""

from __future__ import annotations

import math

import pytest

from receiver.controllers.references import Constant, Listed, Reference, Sine, Square, Step

TICK_S = 0.01


def angles(reference: Reference, ticks: list[int]) -> list[float]:
    return [reference.value(tick) for tick in ticks]


def test_constant_and_step() -> None:
    assert angles(Constant(0.3, TICK_S), [0, 1, 10**6]) == [0.3, 0.3, 0.3]
    assert angles(Step(-0.4, 0.29, TICK_S), [0, 28, 29, 30]) == [0.0, 0.0, -0.4, -0.4]
    assert Step(1.0, 0.0, TICK_S).value(0) == 1.0


def test_step_starts_on_its_tick_whatever_the_division_rounds_to() -> None:
    # 0.07 / 0.01 is a little above 7 in floating point.
    for tick in range(1, 3000):
        assert angles(Step(1.0, tick * TICK_S, TICK_S), [tick - 1, tick]) == [0.0, 1.0]
    assert angles(Step(1.0, 0.07, TICK_S), [6, 7]) == [0.0, 1.0]


def test_square_starts_high_and_switches_every_half_period() -> None:
    square = Square(math.pi / 2, 25.0, TICK_S)
    high, low = math.pi / 2, -math.pi / 2
    ticks = [0, 1249, 1250, 2499, 2500, 3749, 3750]
    assert angles(square, ticks) == [high, high, low, low, high, high, low]


@pytest.mark.parametrize("half_ticks", [1, 3, 7, 29, 1250])
def test_square_switches_on_the_tick_in_a_long_run(half_ticks: int) -> None:
    square = Square(1.0, 2 * half_ticks * TICK_S, TICK_S)
    for half_period in [*range(200), 99_999, 100_000]:
        first = half_period * half_ticks
        expected = -1.0 if half_period % 2 else 1.0
        assert angles(square, [first, first + half_ticks - 1]) == [expected, expected]


def test_sine_starts_at_zero_and_rises() -> None:
    sine = Sine(0.5, 4.0, TICK_S)
    assert angles(sine, [0, 100, 200, 300]) == pytest.approx([0.0, 0.5, 0.0, -0.5], abs=1e-12)
    assert sine.value(1) > 0.0


def test_listed_values_hold_until_the_next() -> None:
    ticks = [0, 1, 2, 28, 29, 30, 10**6]
    listed = Listed((0.02, 0.29, 0.295), (0.5, -1.0, 2.5), TICK_S)
    assert angles(listed, ticks) == [0.5, 0.5, 0.5, 0.5, -1.0, 2.5, 2.5]


def test_values_out_of_range_are_refused_by_name() -> None:
    with pytest.raises(ValueError, match=r"period_s is 0\.015; it must be finite and at least 0\.02"):
        Square(1.0, 0.015, TICK_S)
    with pytest.raises(ValueError, match="amplitude is nan"):
        Sine(math.nan, 1.0, TICK_S)
    with pytest.raises(ValueError, match="start_s is -1"):
        Step(1.0, -1.0, TICK_S)
    with pytest.raises(ValueError, match="tick_s is 0"):
        Constant(1.0, 0.0)
