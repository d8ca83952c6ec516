"""What goes wrong on a line on purpose: read from a text, seeded, counted."""

from __future__ import annotations

from typing import Any

import pytest

from channel.codec.codec import Alphabet
from channel.codec.downlink.layout import DOWN_ALPHABET
from channel.line.impairments import FOR_EVER_NS, ImpairedLine, Impairments, parse_impairments
from channel.line.line import CleanLine, Delivery, Inlet
from channel.links.serial.wire import SerialWire
from channel.protocol import wire
from channel.protocol.endings import Ending
from channel.protocol.frames import Bye, DownSymbol, ShortSymbol, Symbol
from channel.protocol.wire import Wire

MS = 1_000_000
SECOND = 1_000_000_000
BITS = Alphabet((-1, 1), 1)
SYMBOL = wire.encode(Symbol(1, 0, 5, 1))
MESSAGES = 20_000


def line(seed: str = "a", **changes: Any) -> ImpairedLine:
    return ImpairedLine(Impairments(**changes), BITS, seed)


def carried(one: ImpairedLine, count: int = MESSAGES) -> list[list[Delivery]]:
    return [one.carry(SYMBOL, index * MS) for index in range(count)]


def test_when_a_text_names_everything_then_both_directions_have_it() -> None:
    faults = parse_impairments(
        "loss=20%, burst=0.02/0.25, flip=0.01, raw=0.03, duplicate=0.1, reorder=0.2/80ms, "
        "delay=30ms±10ms, cut=10s+2s, dead=30s, skew=-200ppm, step=50ms@10s"
    )
    assert faults.up == faults.down
    assert faults.up == Impairments(
        0.2, 0.02, 0.25, 0.01, 0.03, 0.1, 0.2, 80 * MS, 30 * MS, 10 * MS,
        ((10 * SECOND, 12 * SECOND), (30 * SECOND, FOR_EVER_NS)),
    )  # fmt: skip
    assert faults.skew_ppm == -200.0
    assert faults.clock_steps == ((10 * SECOND, 50 * MS),)
    assert faults.longest_delay_ns == 80 * MS


def test_when_an_item_has_a_direction_then_the_other_is_spared() -> None:
    faults = parse_impairments("up:loss=0.3,down:delay=5ms+-1ms")
    assert faults.up == Impairments(loss=0.3)
    assert faults.down == Impairments(delay_ns=5 * MS, jitter_ns=MS)
    assert not parse_impairments("").any


def test_when_a_clock_jumps_back_then_its_step_is_negative() -> None:
    assert parse_impairments("step=-50ms@10s").clock_steps == ((10 * SECOND, -50 * MS),)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("loss", "NAME=VALUE"),
        ("loss=1.5", "between 0 and 1"),
        ("los=0.1", "no such impairment"),
        ("left:loss=0.1", "only up: and down:"),
        ("delay=30", "no time"),
        ("delay=5ms±6ms", "larger than the delay"),
        ("cut=10s", "START+LENGTH"),
        ("burst=0.1/0", "left some time"),
        ("loss=often", "'often' is no number"),
        ("loss=nan", "no number"),
        ("skew=nan", "no number"),
        ("skew=-1000000ppm", "stand still"),
        ("delay=-5ms", "no time from 0 on"),
        ("reorder=0.1/-5ms", "no time from 0 on"),
        ("cut=10s+-2s", "no time from 0 on"),
        ("step=5ms@-1s", "no time from 0 on"),
    ],
)
def test_when_an_item_makes_no_sense_then_it_is_named(text: str, words: str) -> None:
    with pytest.raises(ValueError, match="impairment") as caught:
        parse_impairments(f"flip=0.1,{text}")
    assert words in str(caught.value)
    assert text in str(caught.value)


def test_when_messages_are_lost_then_time_passes_and_the_share_is_right() -> None:
    one = line(loss=0.2)
    deliveries = carried(one)
    lost = [each for each in deliveries if each[0].data is None]
    assert len(lost) == one.counts["lost"]
    assert abs(len(lost) / MESSAGES - 0.2) < 0.01


def test_when_losses_come_in_bursts_then_they_are_longer_than_chance_makes_them() -> None:
    one = line(burst_enter=0.02, burst_leave=0.25)
    lost = [each[0].data is None for each in carried(one)]
    assert abs(sum(lost) / MESSAGES - 0.02 / 0.27) < 0.015
    runs = sum(now and not before for before, now in zip([False, *lost], lost, strict=False))
    assert 3.5 < sum(lost) / runs < 4.5  # 1 / 0.25


def test_when_a_symbol_is_flipped_then_it_is_a_valid_frame_with_another_symbol() -> None:
    one = line(flip=1.0)
    ((delivery,),) = carried(one, 1)
    assert delivery.data is not None
    assert wire.decode(delivery.data) == Symbol(1, 0, 5, 0)
    goodbye = wire.encode(Bye(1, Ending.OVER, "done"))
    assert one.carry(goodbye, 0) == [Delivery(0, goodbye)]


def test_when_raw_bits_are_inverted_then_the_check_finds_it() -> None:
    one = line(raw=1.0)
    for (delivery,) in carried(one, 500):
        assert delivery.data is not None
        assert Inlet().take(delivery.data) is None
    assert one.counts["corrupted"] == 500


def test_when_the_line_is_cut_then_nothing_passes_for_that_time() -> None:
    one = line(cuts=((10 * MS, 12 * MS),))
    arrived = [deliveries[0].data is not None for deliveries in carried(one, 20)]
    assert arrived == [True] * 10 + [False] * 2 + [True] * 8


def test_when_messages_are_delayed_doubled_and_held_back_then_by_what_was_asked() -> None:
    one = line(delay_ns=30 * MS, jitter_ns=10 * MS, duplicate=0.5, reorder=0.1, reorder_ns=50 * MS)
    doubled = 0
    for index, deliveries in enumerate(carried(one)):
        doubled += len(deliveries) == 2
        for arrival_ns, data in deliveries:
            assert data == SYMBOL
            assert 20 * MS <= arrival_ns - index * MS <= one.longest_delay_ns + 50 * MS
    assert doubled == one.counts["duplicated"]
    assert abs(doubled / MESSAGES - 0.5) < 0.02
    assert abs(one.counts["reordered"] / MESSAGES - 0.1) < 0.01


def test_when_the_seed_is_the_same_then_so_is_what_goes_wrong() -> None:
    changes = {"loss": 0.2, "flip": 0.1, "raw": 0.1, "duplicate": 0.2}
    assert carried(line(**changes), 500) == carried(line(**changes), 500)
    assert carried(line(**changes), 500) != carried(line("b", **changes), 500)


def test_when_a_symbol_byte_of_a_serial_line_is_flipped_then_its_slot_stays() -> None:
    serial = SerialWire(2)
    one = ImpairedLine(Impairments(flip=1.0), BITS, "a", serial)
    ((_, data),) = one.carry(serial.encode(Symbol(1, 0, 5, 1)), 0)
    assert data is not None
    assert serial.decode(data) == ShortSymbol(0, 5, serial.slot_modulus)
    assert one.counts["flipped"] == 1


@pytest.mark.parametrize("form", [wire.DATAGRAM, SerialWire(8)])
def test_when_a_down_symbol_is_flipped_then_it_is_the_other_one_in_the_same_slot(form: Wire) -> None:
    one = ImpairedLine(Impairments(flip=1.0), DOWN_ALPHABET, "a", form)
    for number in (0, 1):
        ((_, data),) = one.carry(form.encode(DownSymbol(1, 2, 7, number)), 0)
        assert data == form.encode(DownSymbol(1, 2, 7, 1 - number))
    assert one.counts["flipped"] == 2


def test_when_a_line_has_a_delay_of_its_own_then_impairments_come_on_top() -> None:
    one = ImpairedLine(Impairments(delay_ns=2), BITS, "a", line=CleanLine(5))
    assert one.longest_delay_ns == 7
    assert one.carry(SYMBOL, 1) == [Delivery(8, SYMBOL)]
    lost = ImpairedLine(Impairments(loss=1.0), BITS, "a", line=CleanLine(5))
    assert lost.carry(SYMBOL, 1) == [Delivery(6, None)]
