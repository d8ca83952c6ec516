"""When slots are due by the receiver's clock, and which symbols count when that is not so."""

from __future__ import annotations

import random

from channel.protocol.rivals import RIVALS
from receiver.session.schedule import EARLY_SAMPLES, Schedule, Timing
from tests.channel.codec.parts import terms

PERIOD_NS = 100_000_000
ALLOWANCE_NS = 20_000_000
TERMS = terms(deadline_allowance_ns=ALLOWANCE_NS)


def running(slots: int = 50) -> Schedule:
    schedule = Schedule(TERMS)
    schedule.begin(0, 0)
    for slot in range(slots):
        assert schedule.timing(slot, slot * PERIOD_NS) is Timing.DUE
        schedule.take(slot, slot * PERIOD_NS)
    return schedule


def test_when_symbols_jitter_within_the_allowance_then_all_are_due() -> None:
    chance = random.Random(1)
    schedule = running()
    for slot in range(50, 500):
        now_ns = slot * PERIOD_NS + chance.randrange(-ALLOWANCE_NS, ALLOWANCE_NS)
        assert schedule.timing(slot, now_ns) is Timing.DUE
        anchor, from_ns = schedule.take(slot, now_ns)
        assert anchor == slot
        assert 0 <= from_ns - now_ns <= 2 * ALLOWANCE_NS


def test_when_a_symbol_is_far_too_early_then_it_is_not_due_and_changes_nothing() -> None:
    schedule = running()
    now_ns = 50 * PERIOD_NS
    assert schedule.timing(50 + EARLY_SAMPLES, now_ns) is Timing.DUE
    assert schedule.timing(50 + EARLY_SAMPLES + 1, now_ns) is Timing.EARLY
    assert schedule.timing(2**31, now_ns) is Timing.EARLY
    assert schedule.take(50, now_ns) == (50, now_ns)


def test_when_a_symbol_is_somewhat_early_then_the_deadlines_stay_where_they_were() -> None:
    schedule = running()
    slot, from_ns = schedule.take(53, 50 * PERIOD_NS)
    assert slot == 53
    assert abs(from_ns - 53 * PERIOD_NS) <= PERIOD_NS // 16


def test_when_many_forged_symbols_come_at_once_then_they_do_not_drag_the_schedule_along() -> None:
    schedule = running()
    now_ns = 50 * PERIOD_NS
    taken = [slot for slot in range(50, 200) if schedule.timing(slot, now_ns) is Timing.DUE]
    for slot in taken:
        schedule.take(slot, now_ns)
    assert max(taken) == 50 + EARLY_SAMPLES
    assert schedule.timing(50 + EARLY_SAMPLES + 2, now_ns) is Timing.EARLY


def test_when_the_clock_was_set_back_then_a_row_that_fits_itself_is_accepted() -> None:
    schedule = running()
    back_ns = 10 * PERIOD_NS
    timings = [schedule.timing(slot, slot * PERIOD_NS - back_ns) for slot in range(50, 50 + RIVALS)]
    assert timings == [Timing.EARLY] * (RIVALS - 1) + [Timing.NEW]
    slot = 49 + RIVALS
    schedule.take(slot, slot * PERIOD_NS - back_ns, anew=True)
    assert schedule.timing(slot + 1, (slot + 1) * PERIOD_NS - back_ns) is Timing.DUE


def test_when_a_symbol_in_time_comes_between_then_the_row_begins_again() -> None:
    schedule = running()
    back_ns = 10 * PERIOD_NS
    for slot in range(50, 100):
        assert schedule.timing(slot + 10, slot * PERIOD_NS) is Timing.EARLY
        schedule.take(slot, slot * PERIOD_NS)
    assert schedule.timing(100, 100 * PERIOD_NS - back_ns) is Timing.EARLY


def test_when_the_clock_went_ahead_then_late_symbols_in_a_row_replace_the_schedule() -> None:
    schedule = running()
    late_ns = 5 * PERIOD_NS
    replaced = [
        schedule.is_replaced_by(slot, slot * PERIOD_NS + late_ns) for slot in range(50, 50 + RIVALS)
    ]
    assert replaced == [False] * (RIVALS - 1) + [True]


def test_when_nothing_was_heard_for_long_then_the_two_clocks_may_have_drifted() -> None:
    schedule = running()
    hour_ns = 3600 * 10**9
    slot = 50 + hour_ns // PERIOD_NS + 20
    assert schedule.timing(slot, 50 * PERIOD_NS + hour_ns) is Timing.DUE
    assert schedule.timing(slot + 100, 50 * PERIOD_NS + hour_ns) is Timing.EARLY


def test_when_a_request_is_for_a_sample_that_the_clock_cannot_have_reached_then_it_is_known() -> None:
    schedule = Schedule(TERMS)
    assert schedule.reaches(2**31, 0), "before the first epoch nothing is known"
    schedule = running()
    assert schedule.reaches(51, 50 * PERIOD_NS)
    assert schedule.reaches(0, 50 * PERIOD_NS)
    assert not schedule.reaches(2**31, 50 * PERIOD_NS)
