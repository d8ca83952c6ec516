"""Echoes back in the order of their samples."""

from __future__ import annotations

import random

from channel.frames import Echo
from transmitter.echo_order import EchoOrder

REPEATS = 2


def frame(newest: int) -> list[Echo]:
    return [Echo(sample, 0, 0, ()) for sample in range(max(0, newest - REPEATS), newest + 1)]


def taken(order: EchoOrder, expected: int) -> list[int]:
    samples = []
    while (echo := order.take(expected + len(samples))) is not None:
        samples.append(echo.sample)
    return samples


def test_when_frames_come_in_order_then_each_echo_is_taken_once() -> None:
    order, got = EchoOrder(REPEATS), 0
    for newest in range(20):
        assert order.add(frame(newest), got)
        got += len(taken(order, got))
        assert got == newest + 1


def test_when_more_frames_are_lost_than_each_repeats_then_the_echo_is_lost() -> None:
    assert EchoOrder(REPEATS).add(frame(7), 5)
    assert not EchoOrder(REPEATS).add(frame(8), 5)


def test_when_frames_overtake_each_other_within_reach_then_none_is_lost() -> None:
    chance = random.Random(3)
    overtaking = 6
    order, got = EchoOrder(REPEATS + overtaking), 0
    arrivals = sorted(range(400), key=lambda newest: newest + chance.uniform(0.0, overtaking))
    assert arrivals != sorted(arrivals)
    for newest in arrivals:
        if newest >= got:
            assert order.add(frame(newest), got)
            samples = taken(order, got)
            assert samples == list(range(got, got + len(samples)))
            got += len(samples)
    assert got == 400


def test_when_a_new_epoch_begins_then_old_echoes_are_forgotten() -> None:
    order = EchoOrder(REPEATS)
    order.add(frame(5), 5)
    order.clear()
    assert order.take(5) is None
