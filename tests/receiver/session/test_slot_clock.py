"""Which slot is settled when: what the receiver's session and the studies share."""

from __future__ import annotations

from receiver.session.schedule import SlotClock
from tests.channel.codec.parts import terms

MS = 1_000_000
TERMS = terms(deadline_allowance_ns=20 * MS)
"""slots of 100 ms"""


def test_when_no_symbol_has_come_then_no_slot_is_due_by_the_clock() -> None:
    clock = SlotClock(TERMS, 5)
    assert clock.deadline_ns is None
    assert list(clock.expired(10**15)) == []
    assert clock.slot == 5


def test_when_a_later_symbol_comes_then_the_slots_before_it_are_settled() -> None:
    clock = SlotClock(TERMS, 5)
    assert list(clock.take(5)) == []
    assert list(clock.take(8)) == [6, 7]
    assert clock.slot == 9


def test_when_deadlines_pass_then_they_count_from_the_last_symbol() -> None:
    clock = SlotClock(TERMS)
    list(clock.take(0))
    clock.anchor((0, 7 * MS))
    assert clock.deadline_ns == 127 * MS
    assert list(clock.expired(127 * MS - 1)) == []
    assert list(clock.expired(227 * MS)) == [1, 2]
    assert clock.silent_slots == 2
    list(clock.take(3))
    assert clock.silent_slots == 0


def test_when_nothing_comes_for_a_whole_history_then_the_clock_says_so() -> None:
    clock = SlotClock(TERMS)
    list(clock.take(0))
    clock.anchor((0, 0))
    settled = 0
    for _ in clock.expired(10**15):
        settled += 1
        if clock.is_silent:
            clock.anchor(None)
    assert settled == TERMS.history_samples
    assert clock.bridges(clock.slot + settled)
    assert not clock.bridges(clock.slot + settled + 1)
