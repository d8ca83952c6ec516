"""The worst-case bound, met exactly: a uniform quantiser, the worst disturbance, only fractions."""

from __future__ import annotations

from fractions import Fraction
from itertools import islice

import pytest

from tenbaud.bounds.worst_case import cell_widths, worst_case_error

CASES = [(Fraction(1), 2, 0), (Fraction(1), 2, 3), (Fraction(3, 2), 2, 2), (Fraction(-5, 4), 4, 1)]


def test_when_an_integrator_has_one_bit_then_a_step_of_delay_costs_as_much_as_the_quantiser() -> None:
    for delay in range(6):
        assert worst_case_error(Fraction(1), 2, delay) == delay + 1


@pytest.mark.parametrize(("growth", "cells", "delay"), CASES)
def test_when_the_recursion_starts_at_its_limit_then_it_stays_there_exactly(
    growth: Fraction, cells: int, delay: int
) -> None:
    limit = 1 / (cells - abs(growth))
    assert list(islice(cell_widths(growth, cells, limit), 20)) == [limit] * 20
    waited = sum((abs(growth) ** step for step in range(delay)), Fraction(0))
    assert worst_case_error(growth, cells, delay) == waited + abs(growth) ** delay * limit


@pytest.mark.parametrize(("growth", "cells", "delay"), CASES)
def test_when_a_quantiser_runs_against_the_worst_disturbance_then_the_bound_is_reached_exactly(
    growth: Fraction, cells: int, delay: int
) -> None:
    """The receiver keeps the interval that the messages leave; the disturbance pushes to its edge."""
    limit = 1 / (cells - abs(growth))
    state, middle, half = limit, Fraction(0), limit
    bound = worst_case_error(growth, cells, delay)
    for _ in range(30):
        guess, truth = middle, state
        for _ in range(delay):  # what happens while the message is on its way
            guess = growth * guess
            truth = growth * truth + (1 if growth * (truth - guess / growth) >= 0 else -1)
        assert abs(truth - guess) == bound
        # The next step, disturbed away from the middle; then the interval is split in cells.
        error = growth * (state - middle)
        state = growth * state + (1 if error >= 0 else -1)
        middle = growth * middle
        half = abs(growth) * half + 1
        assert abs(state - middle) == half
        width = 2 * half / cells
        cell = min(cells - 1, int((state - (middle - half)) / width))
        middle = middle - half + (cell + Fraction(1, 2)) * width
        half = half / cells
        assert abs(state - middle) == half == limit


def test_when_the_quantiser_is_started_wide_then_the_recursion_finds_the_limit() -> None:
    widths = list(islice(cell_widths(Fraction(3, 2), 2, Fraction(1000)), 120))
    assert abs(float(widths[-1]) - 2.0) < 1e-10


def test_when_the_messages_are_too_few_then_the_error_says_how_many_are_needed() -> None:
    with pytest.raises(ValueError, match="more than 2 messages"):
        worst_case_error(Fraction(2), 2, 0)
    with pytest.raises(ValueError, match="at least 0"):
        worst_case_error(Fraction(1), 2, -1)
