"""Clamp, slew and steps of a command, one of each for every input."""

from __future__ import annotations

import math
import random

import pytest

from channel.codec.models.pitch import PITCH_SIGNALS
from channel.codec.signals import InputSignal, Signals, named
from channel.protocol.limits import CommandLimits, from_steps, require_carried, to_steps

SEED = 20240613
LARGEST = 32.767

MIXED = Signals(
    named("state", 2),
    (InputSignal("current", "A", -2.0, 2.0, steps_per_unit=10_000.0), InputSignal("valve", "%")),
    named("output", 1),
)
"""One input with a range and finer steps, one without either."""


def test_when_a_command_is_beyond_the_clamp_then_it_is_cut() -> None:
    limits = CommandLimits.of(PITCH_SIGNALS, 5.0)
    assert limits.apply((7.0, -9.0), (0.0, 0.0)) == (5.0, -5.0)
    assert limits.apply((math.inf, -math.inf), (0.0, 0.0)) == (5.0, -5.0)
    assert limits.apply((4.5, -1.0), (0.0, 0.0)) == (4.5, -1.0)


def test_when_a_step_is_beyond_the_slew_limit_then_it_is_shortened() -> None:
    limits = CommandLimits.of(PITCH_SIGNALS, 5.0, 0.5)
    assert limits.apply((3.0, -3.0), (1.0, 1.0)) == (1.5, 0.5)
    assert limits.apply((1.25, 0.75), (1.0, 1.0)) == (1.25, 0.75)


def test_when_both_limits_act_then_the_clamp_comes_before_the_slew() -> None:
    limits = CommandLimits((5.0,), (1.0,))
    # From 8 V the way down to 5 V takes steps; a clamp after the slew limit would jump.
    assert limits.apply((9.0,), (8.0,)) == (7.0,)
    assert limits.apply((9.0,), (4.5,)) == (5.0,)


def test_when_each_input_has_limits_of_its_own_then_each_keeps_to_them() -> None:
    limits = CommandLimits.of(MIXED, slew_per_tick=[0.5, 1.0])
    assert limits.command_max == (2.0, 5.0), "the range where there is one"
    assert limits.apply((9.0, 9.0), (1.8, 4.5)) == (2.0, 5.0)
    assert limits.apply((9.0, 9.0), (0.0, 0.0)) == (0.5, 1.0)
    three = CommandLimits((1.0, 2.0, 3.0), (math.inf,) * 3)
    assert three.apply((9.0, -9.0, 9.0), (0.0,) * 3) == (1.0, -2.0, 3.0)


def test_when_there_are_no_inputs_then_nothing_is_limited() -> None:
    nothing = Signals(named("state", 1), (), named("output", 1))
    assert CommandLimits((), ()).apply((), ()) == ()
    assert from_steps(to_steps((), nothing), nothing) == ()


def test_when_the_number_of_values_is_wrong_then_it_is_an_error() -> None:
    with pytest.raises(ValueError):
        CommandLimits.of(PITCH_SIGNALS).apply((1.0,), (0.0, 0.0))
    with pytest.raises(ValueError, match=r"3 values; the plant has 2 input.*front, rear"):
        CommandLimits.of(PITCH_SIGNALS, [1.0, 2.0, 3.0])


@pytest.mark.parametrize("value", [0.0, -1.0, LARGEST + 0.001, math.nan, math.inf])
def test_when_the_clamp_is_out_of_range_then_it_is_refused(value: float) -> None:
    with pytest.raises(ValueError, match="input front"):
        CommandLimits.of(PITCH_SIGNALS, [value, 1.0])


@pytest.mark.parametrize("slew", [0.0, -1.0, math.nan])
def test_when_the_slew_limit_is_not_positive_then_it_is_refused(slew: float) -> None:
    with pytest.raises(ValueError, match=r"input rear: .* must be positive"):
        CommandLimits.of(PITCH_SIGNALS, 5.0, [1.0, slew])


def test_when_a_command_is_beyond_what_a_frame_carries_then_the_numbers_are_given() -> None:
    with pytest.raises(ValueError, match=r"current is 4 A.* 3\.2767: 32767 steps of 0\.0001 A"):
        require_carried("command_max", (4.0, 1.0), MIXED)
    require_carried("command_max", (3.2767, LARGEST), MIXED)


@pytest.mark.parametrize("signals", [PITCH_SIGNALS, MIXED])
def test_when_a_command_travels_then_it_comes_back_within_half_a_step_and_stays(
    signals: Signals,
) -> None:
    chooser = random.Random(SEED)
    for _ in range(1000):
        command = [chooser.uniform(-one.largest, one.largest) for one in signals.inputs]
        decoded = from_steps(to_steps(command, signals), signals)
        for one, value, carried in zip(signals.inputs, command, decoded, strict=True):
            assert carried == pytest.approx(value, abs=0.501 / one.steps_per_unit)
        assert from_steps(to_steps(decoded, signals), signals) == decoded
        assert all(-32768 <= value <= 32767 for value in to_steps(command, signals))


def test_when_a_decoded_command_is_limited_again_then_it_moves_by_less_than_a_step() -> None:
    chooser = random.Random(SEED)
    limits = CommandLimits.of(PITCH_SIGNALS, 5.0, 0.0333)
    sent = applied = (0.0, 0.0)
    for _ in range(2000):
        wanted = (chooser.uniform(-6.0, 6.0), chooser.uniform(-6.0, 6.0))
        sent = from_steps(to_steps(limits.apply(wanted, sent), PITCH_SIGNALS), PITCH_SIGNALS)
        applied = limits.apply(sent, applied)
        assert applied == pytest.approx(sent, abs=0.001)
