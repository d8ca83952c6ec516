"""From which tick on a command is owed."""

from __future__ import annotations

from channel.protocol.frames import Why
from tests.channel.codec.parts import terms
from transmitter.session.owing import PAUSES_MAX, Owing

LEAD, PER_SAMPLE = 60, 10
LATEST = LEAD + PER_SAMPLE
"""A healthy epoch begins at most this many ticks after the sample that follows its answer."""


def owing() -> Owing:
    return Owing(terms(lead_ticks=LEAD))


def first_owed(one: Owing) -> int:
    return next(tick for tick in range(10_000) if one.owed_ticks(tick) == 1)


def test_when_a_flight_begins_then_the_first_decided_command_is_owed() -> None:
    one = owing()
    assert first_owed(one) == LEAD
    assert one.begin(200, -1, Why.START) == LEAD
    assert first_owed(one) == 200 + LEAD


def test_when_an_epoch_begins_ahead_then_nothing_is_owed_before_its_first_decided_command() -> None:
    one = owing()
    assert one.begin(1070, 1003, Why.DESYNC) == LEAD
    assert first_owed(one) == 1070 + LEAD


def test_when_the_answer_comes_late_then_a_command_is_owed_when_it_could_be_there() -> None:
    one = owing()
    one.begin(1070, 1203, Why.DESYNC)
    assert first_owed(one) == 1210 + LEAD


def test_when_an_epoch_begins_far_ahead_then_the_watchdog_does_not_wait_for_it() -> None:
    one = owing()
    one.begin(10**9, 1003, Why.DESYNC)
    assert first_owed(one) == 1010 + LATEST + LEAD


def test_when_epoch_after_epoch_brings_no_command_then_the_watchdog_counts_on() -> None:
    one = owing()
    starts = range(1000, 1000 + 100 * (PAUSES_MAX + 3), 100)
    held = [one.begin(start, start - 20, Why.GAP) for start in starts]
    assert held == [LEAD] * PAUSES_MAX + [0] * 3
    assert first_owed(one) == starts[PAUSES_MAX - 1] + LEAD


def test_when_a_command_has_come_or_the_watchdog_tripped_then_the_next_epoch_has_its_time() -> None:
    one = owing()
    for start in range(1000, 2000, 100):
        one.begin(start, start - 20, Why.GAP)
    assert one.begin(2000, 1980, Why.GUARD) == LEAD
    for start in range(3000, 4000, 100):
        one.begin(start, start - 20, Why.GAP)
    one.on_confirmed()
    assert one.begin(4000, 3980, Why.GAP) == LEAD
    assert first_owed(one) == 4000 + LEAD
