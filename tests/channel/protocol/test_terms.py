"""The agreed timing: refusals with their arithmetic, lead, slot grid."""

from __future__ import annotations

from dataclasses import replace

import pytest

from channel.codec.downlink.layout import symbols_carried
from tests.channel.codec.parts import terms

MS = 1_000_000


@pytest.mark.parametrize(("baud", "ticks"), [(10.0, 10), (20.0, 5), (9.99, 11), (10.00001, 10)])
def test_when_the_line_carries_the_symbols_then_the_terms_stand(baud: float, ticks: int) -> None:
    terms(rate_baud=baud, ticks_per_sample=ticks).check("virtual")


def test_when_more_symbols_are_asked_for_than_the_line_carries_then_the_numbers_are_named() -> None:
    with pytest.raises(ValueError) as caught:
        terms(symbols_per_word=2).check("virtual")
    assert str(caught.value) == (
        "2 symbol(s) every 0.1 s ask for 20 symbols/s, but the line carries rate_baud = 10; "
        "lengthen symbol_period_s or raise rate_baud"
    )
    with pytest.raises(ValueError, match="ask for 20 symbols/s"):
        terms(ticks_per_sample=5).check("real")


def test_when_there_is_no_lead_then_only_the_virtual_clock_flies() -> None:
    terms(lead_ticks=0).check("virtual")
    with pytest.raises(ValueError) as caught:
        terms(lead_ticks=0).check("real")
    assert str(caught.value) == (
        "lead_ticks = 0 exists on the virtual clock only: uplink delivery 0 ms + deadline allowance "
        "20 ms + downlink budget 10 ms need lead_ticks >= 3 at 10 ms a tick"
    )


@pytest.mark.parametrize("clock", ["real", "virtual"])
def test_when_the_lead_is_too_short_then_the_sum_is_named(clock: str) -> None:
    short = terms(lead_ticks=12, delivery="end")
    with pytest.raises(ValueError) as caught:
        short.check(clock)  # type: ignore[arg-type]
    assert str(caught.value) == (
        "lead_ticks = 12 is too short: uplink delivery 100 ms + deadline allowance 20 ms + "
        "downlink budget 10 ms need lead_ticks >= 13 at 10 ms a tick"
    )
    terms(lead_ticks=13, delivery="end").check(clock)  # type: ignore[arg-type]


def test_when_symbols_arrive_at_the_end_of_their_slot_then_no_lead_at_all_is_refused() -> None:
    with pytest.raises(ValueError, match="lead_ticks = 0 is too short"):
        terms(delivery="end").check("virtual")


def test_when_a_word_has_two_symbols_then_the_second_slot_is_uplink_delivery() -> None:
    two = terms(symbols_per_word=2, rate_baud=20.0)
    assert two.uplink_delivery_ns == 50 * MS
    assert terms(symbols_per_word=2, delivery="end").uplink_delivery_ns == 100 * MS
    with pytest.raises(ValueError, match="uplink delivery 50 ms"):
        two.check("virtual")
    terms(symbols_per_word=2, rate_baud=20.0, lead_ticks=8).check("real")


@pytest.mark.parametrize(
    ("allowance_ns", "budget_ns", "delivery", "needed"),
    [
        (0, 0, "start", 1),  # on a real clock never less than one tick
        (1, 0, "start", 1),
        (10 * MS, 0, "start", 1),
        (10 * MS + 1, 0, "start", 2),
        (20 * MS, 10 * MS, "start", 3),
        (20 * MS, 10 * MS, "end", 13),
        (25 * MS, 0, "end", 13),
    ],
)
def test_when_delays_are_added_up_then_the_lead_is_rounded_up(
    allowance_ns: int, budget_ns: int, delivery: str, needed: int
) -> None:
    some = terms(deadline_allowance_ns=allowance_ns, downlink_budget_ns=budget_ns, delivery=delivery)
    assert some.lead_needed_ticks == needed


def test_when_the_delivery_is_at_the_end_then_a_symbol_takes_its_slot() -> None:
    assert terms().symbol_delay_ns == 0
    assert terms(delivery="end").symbol_delay_ns == 100 * MS
    assert terms(delivery="end", symbols_per_word=4).symbol_delay_ns == 25 * MS


@pytest.mark.parametrize(("ticks", "symbols"), [(10, 1), (10, 2), (10, 3), (5, 2), (7, 3), (7, 7)])
def test_when_slots_are_laid_out_then_each_begins_within_its_own_sample(
    ticks: int, symbols: int
) -> None:
    some = terms(ticks_per_sample=ticks, symbols_per_word=symbols)
    for slot in range(3 * symbols * ticks):
        sample = slot // symbols
        exact = slot * some.sample_ns  # of one slot, `symbols` times
        assert some.slot_ns(slot) * symbols <= exact < (some.slot_ns(slot) + 1) * symbols
        begin_ns, end_ns = sample * some.sample_ns, (sample + 1) * some.sample_ns
        assert begin_ns <= some.slot_ns(slot) < some.slot_ns(slot + 1) <= end_ns
    assert some.slot_ns(symbols * 12) == 12 * some.sample_ns


def test_when_symbols_do_not_divide_the_ticks_then_slots_are_evenly_spaced_all_the_same() -> None:
    some = terms(ticks_per_sample=5, symbols_per_word=2)
    assert [some.slot_ns(slot) for slot in range(4)] == [0, 25 * MS, 50 * MS, 75 * MS]
    assert some.uplink_delivery_ns == 25 * MS


def test_when_a_word_has_more_symbols_than_ticks_then_its_slots_lie_between_them() -> None:
    some = terms(ticks_per_sample=1, symbols_per_word=10, rate_baud=1000.0, lead_ticks=4)
    some.check("virtual")
    assert some.uplink_delivery_ns == 9 * MS


@pytest.mark.parametrize(("repeats", "ticks"), [(255, 10), (60, 100)])
def test_when_a_command_frame_cannot_carry_the_repeats_then_the_terms_are_refused(
    repeats: int, ticks: int
) -> None:
    with pytest.raises(ValueError):
        terms(repeats=repeats, ticks_per_sample=ticks).check("virtual")


@pytest.mark.parametrize(("period_ns", "samples"), [(100 * MS, 64), (2 * MS, 125), (MS // 2, 500)])
def test_when_samples_are_short_then_the_bound_on_lag_is_a_time(period_ns: int, samples: int) -> None:
    assert terms(tick_ns=period_ns, ticks_per_sample=1).history_samples == samples


def test_when_the_downlink_is_narrow_then_a_coded_command_waits_for_all_symbols_of_its_sample() -> None:
    narrow = terms().narrowed(20.0, 2, is_mirrored=False)
    # 20 ms until the word is settled, 50 ms to the second slot, 10 ms on the way.
    assert (narrow.down_grid.slot_ns(1), narrow.heard_ns) == (70 * MS, 80 * MS)
    assert narrow.with_shortest_lead("virtual").lead_ticks == narrow.lead_needed_ticks == 8
    with pytest.raises(ValueError) as caught:
        replace(narrow, lead_ticks=7).check("real")
    assert str(caught.value) == (
        "lead_ticks = 7 is too short: down symbols, which are all there 80 ms after a sample, need "
        "lead_ticks >= 8 at 10 ms a tick"
    )
    assert narrow.linger_ns(0) == 80 * MS


def test_when_the_law_is_mirrored_then_the_real_clock_needs_no_lead() -> None:
    mirrored = terms(delivery="end", lead_ticks=0).narrowed(20.0, 2, is_mirrored=True)
    assert mirrored.with_shortest_lead("real").lead_ticks == 0
    mirrored.check("real")
    assert mirrored.heard_ns == (100 + 20 + 50 + 50 + 10) * MS


def test_when_the_down_line_carries_no_symbol_a_sample_then_the_numbers_are_named() -> None:
    with pytest.raises(ValueError, match=r"ask for 10 symbols/s, .* carries downlink_baud = 5;"):
        terms().narrowed(5.0, symbols_carried(5.0, 100 * MS), is_mirrored=True).check("virtual")
    assert [symbols_carried(baud, 100 * MS) for baud in (5.0, 19.9, 20.0, 1e5)] == [1, 1, 2, 32]
