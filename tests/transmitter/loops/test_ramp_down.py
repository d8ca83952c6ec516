"""The way down after a flight, and the end of everything else."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from channel.codec.codec import Vector
from channel.codec.models.pitch import PITCH_SIGNALS
from channel.protocol.limits import CommandLimits
from transmitter.guard import Guard, GuardSettings
from transmitter.loops.real import RampDown

TICK_NS = 10_000_000
RAMP_TICKS = 50


def node(ramps_down: bool, volts: Vector = (4.0, -2.0)) -> Any:
    guard = Guard(CommandLimits.of(PITCH_SIGNALS, 5.0), GuardSettings(50, RAMP_TICKS, (0.0, 0.0)))
    guard.apply(0, volts)
    written: list[Vector] = []
    rig = SimpleNamespace(ramps_down=ramps_down, write=lambda _tick, value: written.append(value))
    terms = SimpleNamespace(tick_ns=TICK_NS)

    class Node:
        latched = property(lambda self: guard.state.value == "latched")

    one: Any = Node()
    one.guard, one.rig, one.session, one.written = guard, rig, SimpleNamespace(terms=terms), written
    return one


def test_a_real_rig_goes_down_along_the_ramp_one_step_a_tick() -> None:
    one = node(ramps_down=True)
    ramp_down = RampDown(one, 100)
    now_ns = 100 * TICK_NS
    while not ramp_down.over:
        assert ramp_down.next_ns == now_ns
        ramp_down.step(now_ns - 1)
        ramp_down.step(now_ns)
        now_ns += TICK_NS
    assert len(one.written) == RAMP_TICKS
    fronts = [front for front, _ in one.written]
    assert fronts == sorted(fronts, reverse=True)
    assert fronts[0] == pytest.approx(4.0 * (1 - 1 / RAMP_TICKS))
    assert one.written[-1] == (0.0, 0.0)


def test_a_simulated_rig_is_left_as_it_is() -> None:
    one = node(ramps_down=False)
    ramp_down = RampDown(one, 100)
    ramp_down.step(10**12)
    assert ramp_down.over
    assert one.written == []
    assert not one.guard.stopped


def test_ticks_that_were_missed_are_not_made_up_for() -> None:
    one = node(ramps_down=True)
    ramp_down = RampDown(one, 100)
    ramp_down.step(150 * TICK_NS)
    ramp_down.step(150 * TICK_NS)
    assert len(one.written) == 1
    assert ramp_down.next_ns == 151 * TICK_NS
