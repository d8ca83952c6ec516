"""The narrow downlink on the line: symbols in their slots, and none in a burst."""

from __future__ import annotations

from typing import Any

import pytest

from channel.line.line import CleanLine, Downlink
from channel.line.slots import Departure
from channel.protocol.endings import Ending
from channel.protocol.frames import Bye, DownSymbol
from channel.protocol.terms import Terms
from channel.protocol.wire import DATAGRAM, encode
from tenbaud.recording.memory import MemoryRecorder
from tests.channel.codec.parts import terms

MS = 1_000_000
BYE = Bye(1, Ending.OVER, "done")


def narrow(symbols: int = 2, **changes: Any) -> Terms:
    return terms(downlink="narrow", downlink_baud=10.0 * symbols, down_symbols=symbols, **changes)


def word(sample: int, symbols: int = 2) -> list[DownSymbol]:
    return [DownSymbol(1, 0, slot, 1) for slot in range(sample * symbols, (sample + 1) * symbols)]


def test_when_words_are_settled_then_their_slots_follow_and_all_are_due_within_the_budget() -> None:
    some = narrow(4, uplink_line_ns=3 * MS, downlink_line_ns=2 * MS)
    grid = some.down_grid
    assert [grid.slot_ns(slot) for slot in range(5)] == [23 * MS, 48 * MS, 73 * MS, 98 * MS, 123 * MS]
    assert grid.due_ns(3) == 100 * MS
    assert some.heard_ns == grid.due_ns(3) + some.downlink_budget_ns
    late = narrow(4, delivery="end").down_grid
    assert (late.slot_ns(0), late.due_ns(0)) == (120 * MS, 145 * MS)


@pytest.mark.parametrize("symbols", [1, 2, 10, 32])
@pytest.mark.parametrize("early_ms", [0, 20, 100])
def test_when_a_word_is_settled_early_then_its_symbols_leave_evenly(
    symbols: int, early_ms: int
) -> None:
    downlink = Downlink(terms=narrow(symbols))
    grid = narrow(symbols).down_grid
    for sample in range(20):
        frames = word(sample, symbols)
        offered_ns = grid.slot_ns(frames[0].slot) - early_ms * MS
        leaving = downlink.departures(frames, offered_ns)
        assert leaving == [Departure(grid.slot_ns(one.slot), encode(one)) for one in frames]
    assert (downlink.meter.symbols, downlink.meter.coder_bits) == (20 * symbols, 20 * symbols)
    assert downlink.refused == 0


def test_when_the_receiver_was_held_up_then_no_burst_leaves_and_what_is_over_is_recorded() -> None:
    rows = MemoryRecorder()
    downlink = Downlink(terms=narrow(), recorder=rows)
    frames = [symbol for sample in range(10) for symbol in word(sample)]
    leaving = downlink.departures(frames, 800 * MS)
    assert [one.leaves_ns for one in leaving] == [800 * MS, 820 * MS, 870 * MS, 920 * MS, 970 * MS]
    assert (downlink.refused, downlink.meter.symbols) == (15, 5)
    sent = rows.topic("down_symbol")
    assert [row["left_ns"] for row in sent] == [None] * 15 + [one.leaves_ns for one in leaving]
    assert [row["slot"] for row in sent] == list(range(20))


def test_when_an_epoch_repeats_slots_that_left_then_they_do_not_leave_again() -> None:
    downlink = Downlink(terms=narrow())
    assert len(downlink.departures(word(3), 320 * MS)) == 2
    assert downlink.departures(word(3), 320 * MS) == []


def test_when_control_frames_go_down_then_they_leave_at_once_and_are_counted_apart() -> None:
    downlink = Downlink(terms=narrow())
    leaving = downlink.departures([*word(0), BYE], 0)
    assert [one.leaves_ns for one in leaving] == [20 * MS, 70 * MS, 0]
    assert downlink.meter.control_bytes == len(encode(BYE))
    assert downlink.meter.wire_bytes == len(encode(BYE)) + 2 * 15


def test_when_the_clock_is_real_then_symbols_wait_for_their_slots() -> None:
    downlink = Downlink(DATAGRAM, CleanLine(3 * MS), narrow())
    first, second = (encode(one) for one in word(1))
    now_ns = 5_000 * MS
    assert downlink.offer(word(1), now_ns, lambda: 110 * MS) == []
    assert downlink.next_due_ns == now_ns + 13 * MS
    assert downlink.offer([], now_ns + 13 * MS, lambda: 123 * MS) == [first]
    assert downlink.next_due_ns == now_ns + 63 * MS
    assert downlink.offer([], now_ns + 63 * MS, lambda: 173 * MS) == [second]


def test_when_bits_are_delivered_at_the_end_of_their_slots_then_they_arrive_a_slot_later() -> None:
    downlink = Downlink(terms=narrow(delivery="end"))
    assert [one.leaves_ns for one in downlink.departures(word(0), 100 * MS)] == [170 * MS, 220 * MS]
