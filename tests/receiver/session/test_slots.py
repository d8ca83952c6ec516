"""The receiver decides once per slot what it received, and answers every word with commands."""

from __future__ import annotations

import math

import pytest

from channel.codec.codec import WIRE_ERASED
from channel.codec.models.pitch import PITCH_SIGNALS
from channel.protocol.endings import End, Ending
from channel.protocol.events import EventKind
from channel.protocol.frames import (
    Bye,
    Commands,
    Frame,
    Refuse,
    Symbol,
    Unknown,
    Welcome,
)
from channel.protocol.limits import CommandLimits, from_steps
from channel.protocol.lockstep import HISTORY_SAMPLES
from tests.receiver.session.sessions import (
    CODEC,
    MS,
    PEER,
    SESSION,
    flying,
    kinds,
    receiver,
    symbol,
    two_axes,
    word_numbers,
)

# Symbols and slots


def test_when_symbols_come_in_order_then_each_flies_one_sample() -> None:
    session = flying()
    state = CODEC.initial()
    for slot in range(20):
        number = slot % 3 % 2
        (answer,) = session.on_frame(symbol(slot, number), slot * 100 * MS)
        assert isinstance(answer, Commands)
        state = CODEC.step(state, ((-1, 1)[number],), [(1.0, -1.0)] * 10)
        echo = answer.echoes[-1]
        assert (echo.sample, echo.word_number) == (slot, number)
        assert echo.digest == CODEC.digest(state)
        assert echo.steps == (1000, -1000) * 10
        assert session.state == state
    assert session.counts["erasures"] == 0
    assert session.meter.baud == pytest.approx(10.0)


@pytest.mark.parametrize("repeats", [0, 2, 5])
def test_when_command_frames_are_sent_then_each_repeats_the_last_samples(repeats: int) -> None:
    session = flying(repeats=repeats)
    for slot in range(10):
        (answer,) = session.on_frame(symbol(slot), slot * 100 * MS)
        assert isinstance(answer, Commands)
        expected = list(range(max(0, slot - repeats), slot + 1))
        assert [echo.sample for echo in answer.echoes] == expected
    assert (answer.session, answer.epoch) == (SESSION, 0)


def test_when_slots_are_missing_then_the_gap_is_erased_before_the_symbol_is_taken() -> None:
    session = flying()
    session.on_frame(symbol(0), 0)
    frames = session.on_frame(symbol(4), 400 * MS)
    assert word_numbers(frames) == [WIRE_ERASED] * 3 + [1]
    assert session.counts["erasures"] == 3
    assert kinds(session).count(EventKind.ERASED) == 3


@pytest.mark.parametrize("slot", [0, 1, 2])
def test_when_a_symbol_is_late_or_doubled_then_it_is_dropped_and_counted(slot: int) -> None:
    session = flying()
    session.on_frame(symbol(2), 0)
    before = session.state
    assert session.on_frame(symbol(slot, 0), 0) == []
    assert session.state == before
    assert session.counts["symbols_late"] == 1
    assert session.counts["erasures"] == 2, "the slots before, and none since"
    assert kinds(session)[-1] is EventKind.LATE_SYMBOL


@pytest.mark.parametrize(
    "stale",
    [symbol(0, session=SESSION + 1), symbol(0, session=0)],
    ids=["session", "no session"],
)
def test_when_a_symbol_is_of_another_flight_then_it_is_dropped_and_counted(stale: Symbol) -> None:
    session = flying()
    assert session.on_frame(stale, 0) == []
    assert session.state == CODEC.initial()
    assert session.counts["stale_frames"] == 1


def test_when_a_symbol_is_of_an_epoch_that_was_never_begun_then_its_sender_is_informed() -> None:
    session = flying()
    assert session.on_frame(symbol(0, epoch=1), 0) == [Unknown(SESSION, 1)]
    assert session.state == CODEC.initial()


def test_when_a_symbol_is_not_of_the_alphabet_then_it_is_dropped_and_counted() -> None:
    session = flying()
    assert session.on_frame(symbol(0, number=2), 0) == []
    assert session.counts["out_of_bounds"] == 1
    assert session.state == CODEC.initial()


def test_when_a_slot_is_far_ahead_then_it_is_dropped_and_not_a_gap() -> None:
    session = flying()
    at_ns = (HISTORY_SAMPLES + 1) * 100 * MS
    assert session.on_frame(symbol(HISTORY_SAMPLES + 1), at_ns) == [Unknown(SESSION, 0)]
    assert session.counts["stale_frames"] == 1
    assert kinds(session)[-1] is EventKind.STALE
    assert len(session.on_frame(symbol(HISTORY_SAMPLES), at_ns)) == HISTORY_SAMPLES + 1


@pytest.mark.parametrize(
    "frame",
    [Welcome(SESSION, 0, 0, PEER), Refuse(PEER, Ending.MISMATCH, "", ""), Commands(SESSION, 0, ())],
)
def test_when_a_frame_goes_the_wrong_way_then_it_is_dropped_and_counted(frame: Frame) -> None:
    session = flying()
    assert session.on_frame(frame, 0) == []
    assert session.counts["stale_frames"] == 1


# Deadlines


def test_when_no_symbol_has_come_then_there_is_no_deadline() -> None:
    assert receiver().next_deadline() is None
    assert flying().next_deadline() is None


def test_when_a_symbol_was_in_time_then_the_next_deadline_counts_from_its_arrival() -> None:
    session = flying()
    session.on_frame(symbol(0), 7 * MS)
    assert session.next_deadline() == (7 + 100 + 20) * MS
    assert session.on_deadline(127 * MS - 1) == []
    assert word_numbers(session.on_deadline(127 * MS)) == [WIRE_ERASED]
    # Still anchored on slot 0: an erasure is no arrival.
    assert session.next_deadline() == (7 + 200 + 20) * MS


def test_when_an_anchor_arrives_late_then_the_deadlines_move_with_it() -> None:
    session = flying()
    session.on_frame(symbol(0), 0)
    session.on_frame(symbol(1), 119 * MS)
    assert session.next_deadline() == (119 + 100 + 20) * MS
    session.on_frame(symbol(2), 200 * MS)
    assert session.next_deadline() == (200 + 100 + 20) * MS


def test_when_a_late_copy_comes_then_it_does_not_move_the_deadline() -> None:
    session = flying()
    session.on_frame(symbol(0), 0)
    session.on_deadline(120 * MS)
    session.on_frame(symbol(1), 130 * MS)
    assert session.next_deadline() == 220 * MS
    assert session.counts["symbols_late"] == 1


def test_when_time_has_passed_over_several_deadlines_then_each_slot_is_erased() -> None:
    session = flying()
    session.on_frame(symbol(0), 0)
    assert word_numbers(session.on_deadline(520 * MS)) == [WIRE_ERASED] * 5
    assert session.next_deadline() == 620 * MS


def test_when_the_session_has_ended_then_there_is_no_deadline() -> None:
    session = flying()
    session.on_frame(symbol(0), 0)
    assert session.bye(End(Ending.OVER, "enough")) == [Bye(SESSION, Ending.OVER, "enough")]
    assert session.next_deadline() is None
    assert session.on_deadline(10**12) == []
    assert session.bye(End(Ending.OVER, "again")) == []


# Words of two symbols


def test_when_a_word_has_two_symbols_then_commands_come_with_the_second() -> None:
    session = two_axes()
    assert session.on_frame(symbol(0, 0), 0) == []
    assert session.next_deadline() == (50 + 20) * MS
    assert word_numbers(session.on_frame(symbol(1, 1), 50 * MS)) == [2]  # (-1, +1)
    assert session.next_deadline() == (50 + 50 + 20) * MS


@pytest.mark.parametrize("lost", [0, 1])
def test_when_one_symbol_of_a_word_is_lost_then_the_word_is_erased(lost: int) -> None:
    session = two_axes()
    frames: list[Frame] = []
    for slot in range(4):
        if slot != lost:
            frames += session.on_frame(symbol(slot), slot * 50 * MS)
    assert word_numbers(frames) == [WIRE_ERASED, 3]
    assert session.counts["erasures"] == 1
    erased = session.codec.step(session.codec.initial(), None, [(1.0, -1.0)] * 10)
    assert session.state == session.codec.step(erased, (1, 1), [(1.0, -1.0)] * 10)


# Commands


def test_when_there_is_lead_then_commands_are_of_the_ticks_after_it() -> None:
    session = flying(lead_ticks=13, initial_command=(0.5, 0.25))
    session.on_frame(symbol(0), 0)
    session.on_frame(symbol(1), 0)
    first = CODEC.step(CODEC.initial(), (1,), [(0.5, 0.25)] * 10)
    commands = [(0.5, 0.25)] * 3 + [(1.0, -1.0)] * 7
    assert session.state == CODEC.step(first, (1,), commands)


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf, 1e7])
def test_when_the_controller_gives_no_number_then_the_last_command_is_held(bad: float) -> None:
    session = flying(2.0, -1.5)
    session.on_frame(symbol(0), 0)
    session._commander._asker._controller.volts = (3.0, bad)  # type: ignore[attr-defined]
    (answer,) = session.on_frame(symbol(1), 0)
    assert isinstance(answer, Commands)
    assert answer.echoes[-1].steps == (2000, -1500) * 10
    assert session.counts["bad_commands"] == 10


def test_when_the_controller_has_no_reference_then_the_flight_goes_on_and_says_so_once() -> None:
    session = flying()

    def fail(tick: int) -> tuple[float, ...]:
        raise LookupError("the table ends")

    session._commander._asker._controller.references = fail  # type: ignore[method-assign]
    for slot in range(2):
        session.on_frame(symbol(slot), 0)
        session.flush_records()
    assert session.counts["bad_references"] == 20
    assert kinds(session).count(EventKind.CONTROLLER) == 1


def test_when_commands_are_limited_and_rounded_then_the_codec_uses_what_the_wire_carries() -> None:
    session = flying(7.0, -0.12345, limits=CommandLimits.of(PITCH_SIGNALS, 5.0, 0.3))
    (answer,) = session.on_frame(symbol(0), 0)
    assert isinstance(answer, Commands)
    steps = answer.echoes[-1].steps
    assert steps[:8:2] == (300, 600, 900, 1200)
    assert steps[1::2] == (-123,) * 10
    decoded = [from_steps(steps[2 * tick : 2 * tick + 2], PITCH_SIGNALS) for tick in range(10)]
    assert session.state == CODEC.step(CODEC.initial(), (1,), decoded)
    session.on_frame(symbol(1), 0)
    (answer,) = session.on_frame(symbol(2), 0)
    assert isinstance(answer, Commands)
    assert answer.echoes[-1].steps[::2] == (5000,) * 10
