"""The slot grid, and the meters of what was paid for."""

from __future__ import annotations

import math

import pytest

from channel.codec.codec import Alphabet
from channel.line.line import CleanLine, Uplink, bits_per_symbol
from channel.line.meters import BaudMeter
from channel.line.slots import SlotShaper, SymbolMeter
from channel.protocol import wire
from channel.protocol.endings import Ending
from channel.protocol.frames import Bye, Hello, Symbol
from tests.channel.codec.parts import terms

MS = 1_000_000
HELLO = Hello(1, "1.0", bytes(16), bytes(8))


def test_when_symbols_come_in_their_slots_then_each_passes_once() -> None:
    shaper = SlotShaper(terms().up_grid)
    for slot in range(50):
        assert shaper.departure_ns(slot, slot * 100 * MS + 3) == slot * 100 * MS + 3
        assert shaper.departure_ns(slot, slot * 100 * MS + 4) is None
    assert shaper.refused == 50


def test_when_a_symbol_comes_before_its_slot_then_it_waits_for_it() -> None:
    shaper = SlotShaper(terms().up_grid)
    assert shaper.departure_ns(1, 99 * MS) == 100 * MS
    assert shaper.departure_ns(2, 100 * MS) == 200 * MS


def test_when_a_symbol_comes_more_than_a_sample_ahead_then_it_is_refused() -> None:
    shaper = SlotShaper(terms().up_grid)
    assert shaper.departure_ns(2, 100 * MS - 1) is None
    assert shaper.refused == 1


def test_when_a_symbol_comes_after_its_slot_then_it_is_refused() -> None:
    shaper = SlotShaper(terms().up_grid)
    assert shaper.departure_ns(1, 200 * MS) is None
    assert shaper.departure_ns(2, 300 * MS - 1) == 300 * MS - 1
    assert shaper.refused == 1


def test_when_symbols_were_held_up_then_they_do_not_leave_in_a_burst() -> None:
    shaper = SlotShaper(terms().up_grid)
    leaves = [shaper.departure_ns(slot, 1050 * MS) for slot in range(20)]
    assert leaves == [None] * 10 + [1050 * MS, 1100 * MS] + [None] * 8
    assert shaper.refused == 18


def test_when_a_slot_has_been_used_then_an_earlier_one_never_is() -> None:
    shaper = SlotShaper(terms().up_grid)
    assert shaper.departure_ns(2, 190 * MS) == 200 * MS
    assert shaper.departure_ns(1, 190 * MS) is None


@pytest.mark.parametrize(("ticks", "symbols"), [(5, 2), (1, 10), (7, 3)])
def test_when_a_word_is_offered_whole_then_its_symbols_leave_evenly(ticks: int, symbols: int) -> None:
    some = terms(ticks_per_sample=ticks, symbols_per_word=symbols)
    shaper = SlotShaper(some.up_grid)
    for sample in range(20):
        for slot in range(sample * symbols, (sample + 1) * symbols):
            assert shaper.departure_ns(slot, sample * some.sample_ns) == some.slot_ns(slot)


def test_when_frames_are_metered_then_only_symbols_are_coder_bits() -> None:
    meter = SymbolMeter(bits_per_symbol(Alphabet((-1, 0, 1), 1)))
    meter.count(HELLO, 40, 40)
    for _ in range(10):
        meter.count(Symbol(1, 0, 0, 0), 13, 15)
    assert (meter.symbols, meter.wire_bytes, meter.control_bytes) == (10, 190, 40)
    assert meter.coder_bits == pytest.approx(10 * math.log2(3))


def test_when_symbols_come_every_tenth_of_a_second_then_ten_baud_are_measured() -> None:
    meter = BaudMeter()
    assert meter.baud is None
    meter.on_slot(5_000_000_000, came=True)
    assert meter.baud is None
    for count in range(1, 71):
        meter.on_slot(5_000_000_000 + count * 100 * MS, came=True)
    assert meter.baud == pytest.approx(10.0)


def test_when_symbols_stay_away_then_the_rate_of_the_last_seconds_falls_and_recovers() -> None:
    meter = BaudMeter()
    for count in range(1000):
        meter.on_slot(count * 100 * MS, came=True)
    for count in range(1000, 1025):
        meter.on_slot(count * 100 * MS, came=False)
    assert meter.baud == pytest.approx(5.0, abs=0.2)
    for count in range(1025, 1100):
        meter.on_slot(count * 100 * MS, came=False)
    assert meter.baud == 0.0
    assert meter.whole_baud == pytest.approx(10.0)
    for count in range(1100, 1151):
        meter.on_slot(count * 100 * MS, came=True)
    assert meter.baud == pytest.approx(10.0)
    assert meter.whole_baud == pytest.approx(10.0 * 1050 / 1150)


def test_when_two_symbols_come_at_once_then_no_rate_is_made_up() -> None:
    meter = BaudMeter()
    assert meter.whole_baud is None
    meter.on_slot(7, came=True)
    meter.on_slot(7, came=True)
    assert meter.baud is meter.whole_baud is None


def test_when_a_symbol_is_offered_out_of_its_slot_then_nothing_leaves_and_nothing_is_paid() -> None:
    uplink = Uplink(terms(delivery="end"), Alphabet((-1, 1), 1), CleanLine(3))
    assert uplink.offer(Symbol(1, 0, 2, 0), 0) == []
    assert uplink.meter.wire_bytes == 0
    assert uplink.refused == 1


def test_when_frames_are_offered_then_they_are_encoded_delayed_and_counted() -> None:
    uplink = Uplink(terms(delivery="end"), Alphabet((-1, 1), 1), CleanLine(3))
    symbol, bye = Symbol(1, 0, 0, 1), Bye(1, Ending.OVER, "done")
    assert uplink.offer(symbol, 100) == [(100 * MS + 103, wire.encode(symbol))]
    assert uplink.offer(bye, 100) == [(103, wire.encode(bye))]
    assert uplink.meter.symbols == 1
    assert uplink.meter.control_bytes == len(wire.encode(bye))
