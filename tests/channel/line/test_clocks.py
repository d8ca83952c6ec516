"""A bad clock, and the way back from what it shows."""

from __future__ import annotations

import pytest

from channel.line.clocks import SkewedClock
from channel.line.impairments import parse_impairments

SECOND = 1_000_000_000


def test_when_a_clock_runs_fast_then_it_gains_so_much() -> None:
    clock = SkewedClock(parse_impairments("skew=200ppm"), start_ns=SECOND)
    assert clock.shown(SECOND) == SECOND
    assert clock.shown(11 * SECOND) == 11 * SECOND + 2_000_000


@pytest.mark.parametrize(
    "text", ["skew=150ppm", "step=50ms@10s", "step=-300ms@5s,step=200ms@9s", "skew=-80ppm,step=1s@2s"]
)
def test_when_a_time_is_looked_up_then_it_is_the_first_that_shows_it(text: str) -> None:
    clock = SkewedClock(parse_impairments(text))
    for shown_ns in range(0, 15 * SECOND, 77_777_777):
        true_ns = clock.reached(shown_ns)
        assert clock.shown(true_ns) >= shown_ns
        jumped_over = clock.shown(true_ns) > shown_ns + 2
        assert clock.shown(true_ns - 2) < shown_ns or jumped_over


def test_when_a_clock_jumped_back_then_the_second_time_is_found() -> None:
    clock = SkewedClock(parse_impairments("step=-1s@10s"))
    assert clock.reached(9 * SECOND + SECOND // 2) == 9 * SECOND + SECOND // 2
    again = clock.reached(9 * SECOND + SECOND // 2, not_before_ns=10 * SECOND)
    assert again == 10 * SECOND + SECOND // 2
