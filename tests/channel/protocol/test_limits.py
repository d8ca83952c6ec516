"""Clamp, slew and millivolts of a motor command."""

from __future__ import annotations

import math
import random

import pytest

from channel.protocol.limits import VOLTS_MAX, CommandLimits, from_millivolts, to_millivolts

SEED = 20240613


def test_when_voltages_are_beyond_the_clamp_then_they_are_cut() -> None:
    limits = CommandLimits(5.0)
    assert limits.apply((7.0, -9.0), (0.0, 0.0)) == (5.0, -5.0)
    assert limits.apply((math.inf, -math.inf), (0.0, 0.0)) == (5.0, -5.0)
    assert limits.apply((4.5, -1.0), (0.0, 0.0)) == (4.5, -1.0)


def test_when_a_step_is_beyond_the_slew_limit_then_it_is_shortened() -> None:
    limits = CommandLimits(5.0, 0.5)
    assert limits.apply((3.0, -3.0), (1.0, 1.0)) == (1.5, 0.5)
    assert limits.apply((1.25, 0.75), (1.0, 1.0)) == (1.25, 0.75)


def test_when_both_limits_act_then_the_clamp_comes_before_the_slew() -> None:
    limits = CommandLimits(5.0, 1.0)
    # From 8 V the way down to 5 V takes steps; a clamp after the slew limit would jump.
    assert limits.apply((9.0,), (8.0,)) == (7.0,)
    assert limits.apply((9.0,), (4.5,)) == (5.0,)


def test_when_there_are_no_motors_then_nothing_is_limited() -> None:
    assert CommandLimits(5.0, 1.0).apply((), ()) == ()
    assert from_millivolts(to_millivolts(())) == ()


def test_when_the_number_of_voltages_is_wrong_then_it_is_an_error() -> None:
    with pytest.raises(ValueError):
        CommandLimits().apply((1.0,), (0.0, 0.0))


@pytest.mark.parametrize("volts", [0.0, -1.0, VOLTS_MAX + 0.001, math.nan, math.inf])
def test_when_the_clamp_is_out_of_range_then_it_is_refused(volts: float) -> None:
    with pytest.raises(ValueError, match="volts_max must be in"):
        CommandLimits(volts)


@pytest.mark.parametrize("slew", [0.0, -1.0, math.nan])
def test_when_the_slew_limit_is_not_positive_then_it_is_refused(slew: float) -> None:
    with pytest.raises(ValueError, match="slew limit must be positive"):
        CommandLimits(5.0, slew)


def test_when_voltages_travel_then_they_come_back_within_half_a_millivolt_and_stay() -> None:
    chooser = random.Random(SEED)
    for _ in range(1000):
        volts = (chooser.uniform(-VOLTS_MAX, VOLTS_MAX), chooser.uniform(-5.0, 5.0))
        decoded = from_millivolts(to_millivolts(volts))
        assert decoded == pytest.approx(volts, abs=0.000501)
        assert from_millivolts(to_millivolts(decoded)) == decoded
        assert all(-32768 <= value <= 32767 for value in to_millivolts(volts))


def test_when_a_decoded_command_is_limited_again_then_it_moves_by_less_than_a_millivolt() -> None:
    chooser = random.Random(SEED)
    limits = CommandLimits(5.0, 0.0333)
    sent = applied = (0.0, 0.0)
    for _ in range(2000):
        wanted = (chooser.uniform(-6.0, 6.0), chooser.uniform(-6.0, 6.0))
        sent = from_millivolts(to_millivolts(limits.apply(wanted, sent)))
        applied = limits.apply(sent, applied)
        assert applied == pytest.approx(sent, abs=0.001)
