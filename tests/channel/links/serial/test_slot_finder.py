"""Slots found from a few counter bits and the time: jitter, gaps, noise and a schedule gone wrong."""

from __future__ import annotations

import random

import pytest

from channel.links.serial.slot_finder import SlotFinder
from channel.protocol.frames import Hello, LocatedSymbol, ShortSymbol, Welcome
from channel.protocol.rivals import RIVALS
from tests.channel.codec.parts import terms

MODULUS = 8
SLOT_NS = 100_000_000
MS = 1_000_000
START_NS = 40 * MS
"""Between the hello at time 0 and the arrival of slot 0."""


class Line:
    """A finder with the receiver's own idea of the next slot, which its deadlines move on."""

    def __init__(self, start_ns: int = START_NS, allowance_ns: int = 20 * MS) -> None:
        self.finder = SlotFinder(terms(deadline_allowance_ns=allowance_ns).up_grid)
        self.finder.answered(Hello(5, "", b"", b""), [Welcome(77, 0, 0, 5)], 0)
        self.start_ns = start_ns
        self.allowance_ns = allowance_ns
        self.expected = 0
        self.anchor: tuple[int, int] | None = None

    def due_ns(self, slot: int) -> int:
        return self.start_ns + slot * SLOT_NS

    def hear(self, slot_low: int, time_ns: int) -> LocatedSymbol:
        while self.anchor is not None and self._deadline_ns() < time_ns:
            self.expected += 1
        symbol = ShortSymbol(0, slot_low % MODULUS, MODULUS)
        place = self.finder.find(symbol, self.expected, time_ns)
        if place.in_time:
            assert place.slot is not None
            assert place.slot >= self.expected
            self.expected = place.slot + 1
        self.anchor = place.anchor or self.anchor
        return place

    def _deadline_ns(self) -> int:
        assert self.anchor is not None
        slot, time_ns = self.anchor
        return time_ns + (self.expected - slot) * SLOT_NS + self.allowance_ns


def test_when_symbols_come_with_jitter_then_each_is_found() -> None:
    chooser = random.Random(3)
    line = Line()
    for slot in range(500):
        time_ns = line.due_ns(slot) + chooser.randrange(0, 19) * MS
        place = line.hear(slot, time_ns)
        assert (place.slot, place.in_time) == (slot, True)


def test_when_the_first_came_late_then_the_others_are_found_all_the_same() -> None:
    line = Line()
    assert line.hear(0, line.due_ns(0) + 45 * MS).slot == 0
    assert [line.hear(slot, line.due_ns(slot)).slot for slot in range(1, 50)] == list(range(1, 50))


def test_when_the_grid_is_known_then_down_symbols_are_placed_from_the_first_one_on() -> None:
    chooser = random.Random(4)
    some = terms(downlink="narrow", downlink_baud=40.0, down_symbols=4, downlink_line_ns=5 * MS)
    grid = some.down_grid
    for first in (0, 1, 7, 9, 4003):
        finder = SlotFinder(grid)
        finder.expect()
        for slot in range(first, first + 200):
            if chooser.random() < 0.3:
                continue  # lost
            came_ns = grid.due_ns(slot) + chooser.randrange(9) * MS
            place = finder.find(ShortSymbol(0, slot % MODULUS, MODULUS), 0, came_ns)
            assert (place.slot, place.in_time) == (slot, True)
            noise = (slot + chooser.randrange(2, MODULUS - 1)) % MODULUS
            assert not finder.find(ShortSymbol(0, noise, MODULUS), 0, came_ns + MS).in_time


def test_when_no_symbol_was_placed_then_the_next_request_says_where_the_first_one_is() -> None:
    line = Line()
    late_ns = 6 * SLOT_NS  # the transmitter began later than its receiver takes for possible
    assert line.hear(0, line.due_ns(0) + late_ns).slot is None
    asked_ns = line.due_ns(40) + late_ns - 90 * MS
    again = Hello(5, "", b"", b"", 1, sample=40)
    line.finder.answered(again, [Welcome(77, 1, 41, 5, 1)], asked_ns)
    line.expected = 41
    for slot in range(41, 60):
        assert line.hear(slot, line.due_ns(slot) + late_ns).slot == slot


@pytest.mark.parametrize("first", [1, 3, 7, 8, 9, 20])
def test_when_the_first_symbols_are_lost_then_the_first_that_comes_is_still_placed(first: int) -> None:
    line = Line()
    assert line.hear(first, line.due_ns(first)).slot == first


@pytest.mark.parametrize("gap", [1, 7, 8, 9, 100, 1000])
def test_when_symbols_are_lost_then_the_next_one_is_placed_by_the_time(gap: int) -> None:
    line = Line()
    for slot in range(5):
        line.hear(slot, line.due_ns(slot))
    after = 5 + gap
    place = line.hear(after, line.due_ns(after) + 3 * MS)
    assert (place.slot, place.in_time) == (after, True)


def test_when_a_symbol_comes_after_its_deadline_then_it_is_late() -> None:
    line = Line()
    line.hear(0, line.due_ns(0))
    place = line.hear(1, line.due_ns(1) + 30 * MS)
    assert (place.slot, place.in_time, place.anchor) == (1, False, None)
    assert line.hear(2, line.due_ns(2)).slot == 2


def test_when_a_byte_of_noise_looks_like_a_later_slot_then_it_is_refused() -> None:
    line = Line()
    line.hear(0, line.due_ns(0))
    for low in (2, 3, 4):
        assert line.hear(low, line.due_ns(1) - 10 * MS) == LocatedSymbol(0, None, low, False, None)
    assert line.hear(1, line.due_ns(1)).slot == 1


def test_when_noise_takes_a_slot_early_then_the_schedule_stays_where_it_is() -> None:
    line = Line()
    for slot in range(10):
        line.hear(slot, line.due_ns(slot))
    for slot in range(10, 100, 4):
        assert line.hear(slot, line.due_ns(slot) - 45 * MS).in_time  # noise: a wrong symbol
        assert not line.hear(slot, line.due_ns(slot)).in_time  # the true one comes second
        for later in range(slot + 1, slot + 4):
            assert line.hear(later, line.due_ns(later)).in_time


def test_when_noise_storms_then_slots_do_not_run_away_and_the_line_recovers() -> None:
    chooser = random.Random(8)
    line = Line()
    for slot in range(10):
        line.hear(slot, line.due_ns(slot))
    for time_ns in range(line.due_ns(10), line.due_ns(60), 3 * MS):
        line.hear(chooser.randrange(MODULUS), time_ns)
        assert abs(line.expected - (time_ns - START_NS) / SLOT_NS) < 2.5
    after = [line.hear(slot, line.due_ns(slot) + 5 * MS) for slot in range(61, 90)]
    settled = after[2 * RIVALS :]
    assert [place.slot for place in settled] == list(range(61 + 2 * RIVALS, 90))
    assert all(place.in_time for place in settled)


def test_when_the_line_gets_slower_for_good_then_a_row_of_late_ones_moves_the_schedule() -> None:
    line = Line()
    for slot in range(20):
        line.hear(slot, line.due_ns(slot))
    later = [line.hear(slot, line.due_ns(slot) + 70 * MS) for slot in range(20, 40)]
    assert not any(place.in_time for place in later[: RIVALS - 1])
    assert all(place.in_time for place in later[RIVALS:])
    assert [place.slot for place in later[RIVALS:]] == list(range(20 + RIVALS, 40))


def test_when_a_heap_of_bytes_is_read_at_once_then_it_does_not_move_the_schedule() -> None:
    line = Line()
    for slot in range(10):
        line.hear(slot, line.due_ns(slot))
    pause_ns = line.due_ns(20) + MS
    for slot in range(10, 20):
        line.hear(slot, pause_ns)  # this process stood still for a second
    assert [line.hear(slot, line.due_ns(slot)).slot for slot in range(21, 40)] == list(range(21, 40))


def test_when_noise_comes_before_the_first_symbol_then_it_is_refused_if_it_cannot_be_due() -> None:
    line = Line()
    for low in range(2, MODULUS):
        assert line.hear(low, 5 * MS) == LocatedSymbol(0, None, low, False, None)
    assert line.hear(0, line.due_ns(0)).slot == 0
