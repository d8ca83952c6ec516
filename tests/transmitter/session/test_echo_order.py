"""Echoes back in the order of their samples."""

from __future__ import annotations

import random

from channel.protocol.frames import Echo
from transmitter.session.copies import EchoOrder

REPEATS = 2


def frame(newest: int) -> list[Echo]:
    return [Echo(sample, 0, 0, ()) for sample in range(max(0, newest - REPEATS), newest + 1)]


def taken(order: EchoOrder, expected: int) -> list[int]:
    samples = []
    while (echo := order.take(expected + len(samples))) is not None:
        samples.append(echo.sample)
    return samples


def test_when_frames_come_in_order_then_each_echo_is_taken_once() -> None:
    order, got = EchoOrder(0, 64), 0
    for newest in range(20):
        order.add(frame(newest), got, newest, newest)
        got += len(taken(order, got))
        assert got == newest + 1
        assert not order.is_lost(got, newest)


def test_when_more_frames_are_lost_than_each_repeats_then_the_echo_is_lost_at_once() -> None:
    order = EchoOrder(0, 64)
    order.add(frame(7), 5, 70, 7)
    assert not order.is_lost(5, 70)
    assert taken(order, 5) == [5, 6, 7]
    order.add(frame(11), 8, 110, 11)
    assert order.is_lost(8, 110)
    order.end_before(8)
    assert not order.is_lost(8, 110), "it was not flown"


def test_when_frames_may_overtake_each_other_then_an_echo_is_lost_when_it_can_no_longer_come() -> None:
    order = EchoOrder(30, 64)
    order.add(frame(11), 5, 100, 11)
    order.add(frame(12), 5, 110, 12)
    assert [order.is_lost(5, tick) for tick in (100, 129, 130)] == [False, False, True]
    order.clear()
    assert not order.is_lost(5, 200)
    assert order.take(11) is None


def test_when_frames_overtake_each_other_in_their_time_then_none_is_lost() -> None:
    chance = random.Random(3)
    spread_ticks, per_sample = 60, 10
    order, got, tick = EchoOrder(spread_ticks, 64), 0, 0
    arrivals = sorted(
        (newest * per_sample + chance.randrange(spread_ticks), newest) for newest in range(400)
    )
    assert [newest for _, newest in arrivals] != list(range(400))
    for tick, newest in arrivals:
        assert not order.is_lost(got, tick)
        if newest >= got:
            order.add(frame(newest), got, tick, newest)
            got += len(taken(order, got))
    assert got == 400


def test_when_an_echo_is_further_ahead_than_the_history_then_it_is_not_kept() -> None:
    order = EchoOrder(0, 64)
    order.add(frame(1000), 5, 0, 1000)
    assert order.take(1000) is None
