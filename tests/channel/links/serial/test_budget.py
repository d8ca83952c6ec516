"""The arithmetic of a serial line, by hand and in its refusals."""

from __future__ import annotations

from dataclasses import replace

import pytest

from channel.links.serial.budget import (
    byte_ns,
    check_down,
    check_slot_counter,
    check_up,
    command_bytes,
    least_rate_baud,
)
from channel.links.serial.wire import SerialWire
from tests.channel.codec.parts import pitch_codec, terms

CODEC = pitch_codec()


def test_when_the_papers_flight_is_budgeted_then_it_is_what_a_pencil_says() -> None:
    # Head 8, last sample and count 5, three echoes of word 2, digest 8, 20 voltages of 2, and CRC 2.
    content = 8 + 5 + 3 * (2 + 8 + 20 * 2) + 2
    assert content == 165
    # One code byte, two delimiters.
    assert command_bytes(terms(repeats=2), CODEC) == content + 1 + 2 == 168
    assert byte_ns(1, 110) == pytest.approx(90.909e6, rel=1e-4)
    assert byte_ns(168, 115_200) == pytest.approx(14.583e6, rel=1e-4)


def test_when_a_frame_is_long_then_the_code_bytes_of_every_254_count() -> None:
    content = 15 + 10 * 50
    assert command_bytes(terms(repeats=9), CODEC) == content + 3 + 2


def test_when_the_line_is_just_fast_enough_then_it_is_allowed_and_below_it_is_refused() -> None:
    check_up(terms(), 100)
    with pytest.raises(ValueError, match=r"10 symbols/s x 1 byte x 10 line bits = 100 bit/s") as caught:
        check_up(terms(), 99)
    assert "line_rate_baud = 99" in str(caught.value)
    check_down(terms(), CODEC, 16_800)
    with pytest.raises(
        ValueError, match=r"168 bytes.* x 10 line bits x 10 samples/s = 16800"
    ) as caught:
        check_down(terms(), CODEC, 16_799)
    assert "--downlink" in str(caught.value)
    assert "2 repeats" in str(caught.value)
    assert 'channel.downlink = "compact" at both ends, which needs 1900 baud' in str(caught.value)


def test_when_the_downlink_is_compact_then_2400_baud_carry_the_papers_flight() -> None:
    compact = terms(repeats=2, downlink="compact")
    # One byte of mark, epoch and session; sample 8, digest 16, part 3, three echoes of 2 + 2 x 11 bits
    # and 5 of padding; CRC 2.
    content = 1 + (8 + 16 + 3 + 3 * (2 + 22) + 5) // 8 + 2
    assert content == 16
    assert command_bytes(compact, CODEC) == content + 1 + 2
    assert least_rate_baud(compact, CODEC) == 1900
    check_down(compact, CODEC, 1900)
    with pytest.raises(ValueError, match=r"19 bytes.*= 1900 bit/s") as caught:
        check_down(compact, CODEC, 1899)
    assert "channel.downlink" not in str(caught.value)


def test_when_the_downlink_is_narrow_then_a_symbol_is_a_byte_in_either_direction() -> None:
    narrow = terms(downlink="narrow", downlink_baud=20.0, down_symbols=2)
    assert command_bytes(narrow, CODEC) == 1
    assert least_rate_baud(narrow, CODEC) == 200
    assert least_rate_baud(replace(narrow, down_symbols=1), CODEC) == 100
    check_down(narrow, CODEC, 200)
    with pytest.raises(
        ValueError, match=r"downlink: 20 symbols/s x 1 byte x 10 line bits = 200"
    ) as caught:
        check_down(narrow, CODEC, 199)
    assert "channel.downlink_baud" in str(caught.value)


def test_when_the_budget_spans_too_many_down_slots_then_it_is_refused() -> None:
    narrow = terms(downlink="narrow", downlink_baud=20.0, down_symbols=2)
    check_slot_counter(replace(narrow, downlink_budget_ns=100_000_000), SerialWire(2))
    with pytest.raises(ValueError, match=r"downlink_budget_s = 0.101 is 2.02 slots of 50 ms"):
        check_slot_counter(replace(narrow, downlink_budget_ns=101_000_000), SerialWire(2))


def test_when_bytes_take_a_fraction_of_a_nanosecond_then_it_is_rounded_up() -> None:
    assert byte_ns(1, 115_200) == 86_806
    assert byte_ns(0, 115_200) == 0


@pytest.mark.parametrize(
    ("size", "allowance_ms", "fits"), [(2, 200, True), (2, 201, False), (8, 100, True), (8, 101, False)]
)
def test_when_the_allowance_spans_too_many_slots_then_it_is_refused(
    size: int, allowance_ms: int, fits: bool
) -> None:
    allowed = terms(deadline_allowance_ns=allowance_ms * 1_000_000)
    if fits:
        check_slot_counter(allowed, SerialWire(size))
        return
    with pytest.raises(ValueError, match="deadline_allowance_s") as caught:
        check_slot_counter(allowed, SerialWire(size))
    assert "modulo" in str(caught.value)


def test_when_a_line_has_a_rate_then_the_lead_covers_the_time_on_it() -> None:
    plain = terms(lead_ticks=3)
    plain.check("real")
    slow = terms(lead_ticks=3, uplink_line_ns=90_909_091, downlink_line_ns=14_583_334)
    with pytest.raises(ValueError, match=r"90\.9 ms for a symbol and 14\.6 ms for a command frame"):
        slow.check("real")
    # 20 + 10 + 90.9 + 14.6 ms in ticks of 10 ms.
    assert slow.with_shortest_lead("real").lead_ticks == 14
    slow.with_shortest_lead("real").check("real")
