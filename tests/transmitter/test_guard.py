"""Limiter and watchdog beside the motors."""

from __future__ import annotations

import math

import pytest

from channel.codec.models.pitch import PITCH_SIGNALS
from channel.protocol.limits import CommandLimits
from transmitter.guard import Guard, GuardCause, GuardReason, GuardSettings, GuardState

SAFE = (0.5, -0.5)

STOPPED = GuardReason(GuardCause.STOPPED, 1)


def guard(
    slew: float = math.inf, soft: tuple[float, ...] = (), safe: tuple[float, float] = SAFE
) -> Guard:
    return Guard(CommandLimits.of(PITCH_SIGNALS, 5.0, slew), GuardSettings(3, 4, safe, soft))


def test_when_nothing_has_come_then_the_safe_voltage_is_on_the_motors() -> None:
    one = guard()
    assert one.state is GuardState.READY
    assert one.apply(0, None) == SAFE
    assert one.state is GuardState.READY


def test_when_commands_stay_away_then_it_holds_then_ramps_then_latches() -> None:
    one = guard()
    assert one.apply(0, (4.5, 3.5)) == (4.5, 3.5)
    walk = [(one.apply(tick, None), one.state) for tick in range(1, 10)]
    held = ((4.5, 3.5), GuardState.HOLDING)
    down = [(0.5 + 4.0 * left, -0.5 + 4.0 * left) for left in (0.75, 0.5, 0.25)]
    latched = (SAFE, GuardState.LATCHED)
    assert walk == [held] * 3 + [(volts, GuardState.RAMPING) for volts in down] + [latched] * 3
    assert one.stopped
    assert one.reason == GuardReason(GuardCause.TIMED_OUT, 4, number=4)


def test_when_commands_come_back_in_time_then_it_runs_on_and_the_age_starts_anew() -> None:
    one = guard()
    one.apply(0, (1.0, 1.0))
    for _ in range(5):
        for tick in range(3):
            assert one.apply(tick, None) == (1.0, 1.0)
        assert one.state is GuardState.HOLDING
        one.apply(3, (1.0, 1.0))
        assert one.state is GuardState.RUNNING


def test_when_ticks_are_missed_then_the_watchdog_counts_them_and_the_ramp_does_not() -> None:
    one = guard()
    one.apply(0, (4.5, 3.5))
    assert one.apply(3, None) == (4.5, 3.5)
    assert one.apply(7, None) == (3.5, 2.5)
    assert one.reason == GuardReason(GuardCause.TIMED_OUT, 7, number=7)
    assert one.apply(20, None) == (2.5, 1.5)


def test_when_no_command_ever_comes_then_it_latches_too() -> None:
    one = guard()
    for tick in range(8):
        assert one.apply(tick, None) == SAFE
    assert one.state is GuardState.LATCHED


def test_when_no_command_is_owed_then_the_last_one_is_held_and_does_not_age() -> None:
    one = guard()
    one.apply(0, (1.0, 1.0))
    for tick in range(1, 50):
        assert one.apply(tick, None, owed_ticks=0) == (1.0, 1.0)
    assert one.state is GuardState.HOLDING
    for tick in range(50, 53):
        assert one.apply(tick, None) == (1.0, 1.0)
    one.apply(53, None)
    assert one.state is GuardState.RAMPING
    assert one.reason == GuardReason(GuardCause.TIMED_OUT, 53, number=4)


def test_when_the_loop_stalls_until_commands_are_owed_then_only_owed_ticks_are_missed() -> None:
    one = guard()
    one.apply(0, (1.0, 1.0))
    one.apply(1, None, owed_ticks=0)
    for owed_ticks in (2, 3):
        assert one.apply(58 + owed_ticks, None, owed_ticks) == (1.0, 1.0)
    one.apply(62, None, owed_ticks=4)
    assert one.reason == GuardReason(GuardCause.TIMED_OUT, 62, number=4)


def test_when_it_ramps_or_is_latched_then_no_command_passes_any_more() -> None:
    one = guard()
    one.apply(0, (4.5, 3.5))
    one.trip(STOPPED)
    volts = [one.apply(tick, (5.0, 5.0)) for tick in range(1, 8)]
    assert volts[:2] == [(3.5, 2.5), (2.5, 1.5)]
    assert volts[3:] == [SAFE] * 4
    assert one.reason is STOPPED


def test_when_it_trips_again_then_the_first_reason_stands_and_the_ramp_goes_on() -> None:
    one = guard()
    one.apply(0, (4.5, 3.5))
    one.trip(STOPPED)
    one.apply(1, None)
    one.trip(GuardReason(GuardCause.SENSOR))
    assert one.apply(2, None) == (2.5, 1.5)
    assert one.reason is STOPPED


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_when_a_command_is_not_finite_then_it_never_reaches_the_motors(value: float) -> None:
    one = guard()
    one.apply(0, (4.5, 3.5))
    volts = one.apply(1, (1.0, value))
    assert volts == (3.5, 2.5)
    assert one.state is GuardState.RAMPING
    assert one.reason is not None
    assert (one.reason.cause, one.reason.tick) == (GuardCause.BAD_COMMAND, 1)


def test_when_a_command_is_beyond_both_limits_then_the_clamp_comes_before_the_slew() -> None:
    one = guard(slew=2.0, safe=(0.0, 0.0))
    volts = [one.apply(tick, (9.0, -1.0)) for tick in range(4)]
    assert volts == [(2.0, -1.0), (4.0, -1.0), (5.0, -1.0), (5.0, -1.0)]
    assert one.apply(4, (-9.0, 0.5)) == (3.0, 0.5)


def test_when_commands_are_within_the_limits_then_they_pass_as_they_are() -> None:
    one = guard(slew=10.0)
    for tick in range(20):
        command = (0.25 * tick, -0.1 * tick)
        assert one.apply(tick, command) == command


@pytest.mark.parametrize("angle", [1.01, -1.01, math.inf, math.nan])
def test_when_an_angle_is_beyond_its_soft_limit_then_the_voltage_is_taken_down(angle: float) -> None:
    one = guard(soft=(1.0, 2.0))
    one.apply(0, (4.5, 3.5))
    one.check_outputs(1, (angle, 0.0))
    assert one.apply(1, (5.0, 5.0)) == (3.5, 2.5)
    cause = GuardCause.ANGLE_LIMIT if math.isfinite(angle) else GuardCause.NO_ANGLE
    assert one.reason is not None
    assert (one.reason.cause, one.reason.axis, one.reason.tick) == (cause, 0, 1)


def test_when_angles_are_at_their_soft_limits_then_commands_pass() -> None:
    one = guard(soft=(1.0, 2.0))
    one.check_outputs(0, (-1.0, 2.0))
    assert not one.stopped
    one.check_outputs(0, (1.0, 2.1))
    assert one.reason == GuardReason(GuardCause.ANGLE_LIMIT, 0, 1, 2.1, 2.0)


def test_when_there_are_no_soft_limits_then_any_number_is_an_angle() -> None:
    one = guard()
    one.check_outputs(0, (1e6,))
    assert not one.stopped
    one.check_outputs(0, (math.nan,))
    assert one.stopped


@pytest.mark.parametrize(("timeout", "ramp"), [(0, 1), (1, 0), (-1, 5)])
def test_when_times_are_below_one_tick_then_the_settings_are_refused(timeout: int, ramp: int) -> None:
    with pytest.raises(ValueError, match="at least one tick"):
        GuardSettings(timeout, ramp, SAFE)
