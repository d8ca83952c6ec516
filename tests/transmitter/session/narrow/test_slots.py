"""When the down symbols of a sample are taken together, and what comes after that."""

from __future__ import annotations

import pytest

from tests.channel.codec.parts import terms
from transmitter.session.narrow.slots import LATE_IN_A_ROW, REMEMBERED, Came, DownSlots

TERMS = terms().narrowed(20.0, 2, is_mirrored=True)
DEADLINE = 8
"""Ticks after a sample's first one: 20 ms to settle, 50 ms to the second slot, 10 ms in reserve."""


def test_when_all_symbols_came_then_the_sample_is_taken_at_once() -> None:
    slots = DownSlots(TERMS)
    assert slots.put(0, 1, 2) is Came.NEW
    assert slots.take(DEADLINE - 1) is None
    assert slots.put(1, 0, 7) is Came.NEW
    assert slots.take(7) == (1, 0)
    assert slots.sample == 1


def test_when_a_symbol_is_missing_then_it_is_erased_from_its_deadline_on() -> None:
    slots = DownSlots(TERMS)
    slots.put(1, 1, 7)
    assert slots.take(DEADLINE - 1) is None
    assert slots.take(DEADLINE) == (None, 1)
    assert slots.put(0, 0, DEADLINE) is Came.LATE
    assert slots.take(10 + DEADLINE - 1) is None
    assert slots.take(10 + DEADLINE) == (None, None)


def test_when_a_slot_has_its_symbol_then_another_one_changes_nothing() -> None:
    slots = DownSlots(TERMS)
    slots.put(0, 1, 2)
    assert slots.put(0, 0, 3) is Came.AGAIN
    slots.put(1, 1, 7)
    assert slots.take(7) == (1, 1)


def test_when_symbols_come_before_those_of_the_sample_before_then_they_wait() -> None:
    slots = DownSlots(TERMS)
    slots.put(2, 1, 7)
    slots.put(3, 1, 7)
    assert slots.take(7) is None
    slots.put(0, 0, 7)
    slots.put(1, 0, 7)
    assert [slots.take(7), slots.take(7), slots.take(7)] == [(0, 0), (1, 1), None]


def test_when_the_lines_are_known_to_be_slow_then_deadlines_are_later() -> None:
    slots = DownSlots(TERMS, line_delay_ns=55_000_000)
    assert slots.take(DEADLINE + 5) is None
    assert slots.take(DEADLINE + 6) == (None, None)


def test_when_old_symbols_are_repeated_then_deadlines_stay() -> None:
    slots = DownSlots(TERMS)
    for sample in range(LATE_IN_A_ROW):
        slots.put(2 * sample, 1, 10 * sample + 2)
        assert slots.take(10 * sample + DEADLINE) == (1, None)
    now = 10 * slots.sample + 1
    assert [slots.put(slot, 1, now) for slot in (0, 2, 4)] == [Came.AGAIN] * 3
    assert [slots.put(1, 1, now) for _ in range(LATE_IN_A_ROW)] == [Came.LATE, Came.AGAIN, Came.AGAIN]
    assert slots.take(10 * slots.sample + DEADLINE) == (None, None)


def test_when_every_symbol_is_late_then_deadlines_move_until_it_is_long_past() -> None:
    slots, delay = DownSlots(TERMS), 5
    for sample in range(LATE_IN_A_ROW):
        assert slots.take(10 * sample + DEADLINE) == (None, None)
        assert slots.put(2 * sample, 1, 10 * sample + DEADLINE + delay) is Came.LATE
    sample = slots.sample
    assert slots.take(10 * sample + DEADLINE + delay - 1) is None
    assert slots.put(2 * sample, 1, 10 * sample + DEADLINE + delay) is Came.NEW
    assert slots.put(2 * sample + 1, 1, 10 * sample + DEADLINE + delay) is Came.NEW
    assert slots.take(10 * sample + DEADLINE + delay) == (1, 1)
    for sample in range(slots.sample, slots.sample + REMEMBERED):
        for slot in (2 * sample, 2 * sample + 1):
            slots.put(slot, 1, 10 * sample + DEADLINE - 1)
        assert slots.take(10 * sample + DEADLINE - 1) == (1, 1)
    assert slots.take(10 * slots.sample + DEADLINE) == (None, None)


def test_when_a_late_symbol_is_an_exception_then_deadlines_stay() -> None:
    slots = DownSlots(TERMS)
    for sample in range(2 * LATE_IN_A_ROW):
        slots.put(2 * sample, 1, 10 * sample + 2)
        assert slots.take(10 * sample + DEADLINE) == (1, None)
        slots.put(2 * sample + 1, 1, 10 * sample + DEADLINE + 4)
    assert slots.take(10 * slots.sample + DEADLINE) == (None, None)


@pytest.mark.parametrize("late_ticks", [10**6, 700])
def test_when_an_old_recording_is_played_then_deadlines_stay(late_ticks: int) -> None:
    slots = DownSlots(TERMS)
    slots.restart(5)
    for slot in range(LATE_IN_A_ROW):
        assert slots.put(slot, 1, late_ticks) is Came.AGAIN
    assert slots.take(50 + DEADLINE) == (None, None)
