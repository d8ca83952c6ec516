"""The PID law: its formula, its limits, and what it does to the paper's plant."""

from __future__ import annotations

import math
from dataclasses import dataclass

import pytest

from channel.codec.laws import PidConstants, pid_command
from plant_sim.pitch import PitchParameters, PitchPlant
from receiver.controllers.base import Controller
from receiver.controllers.pid import PAPER_GAINS, AntiWindup, Pid, PidGains
from receiver.controllers.references import Constant, Square

TICK_S = 0.01
AMPLITUDE_RAD = math.pi / 2
HALF_PERIOD_TICKS = 1250


def in_volts_per_rad(proportional: float, integral: float = 0.0, derivative: float = 0.0) -> PidGains:
    return PidGains(proportional, integral, derivative, unit="V/rad")


def steady(level_rad: float) -> Constant:
    return Constant(level_rad, TICK_S)


def test_each_term_enters_as_in_the_paper() -> None:
    pid = Pid(in_volts_per_rad(2.0, 3.0, 0.5), steady(1.0), TICK_S, normal_force_volts=1.0)
    # u = 2 * 0.6 - 0.5 * 0.2 = 1.1; the integral is still empty.
    assert pid.command(0, (0.4, 0.2)) == pytest.approx(((1.0 + 1.1) / 2, (1.0 - 1.1) / 2))
    # Now the integral holds 3 * 0.6 * 0.01 = 0.018 V.
    assert pid.command(1, (1.0, 0.0)) == pytest.approx(((1.0 + 0.018) / 2, (1.0 - 0.018) / 2))
    assert pid.integrals[0] == pytest.approx(0.018)


def test_degrees_multiply_every_gain_by_180_over_pi() -> None:
    per_degree = Pid(PidGains(0.1, 0.05, 0.02, "V/deg"), steady(0.3), TICK_S)
    factor = 180.0 / math.pi
    per_radian = Pid(in_volts_per_rad(0.1 * factor, 0.05 * factor, 0.02 * factor), steady(0.3), TICK_S)
    for tick in range(5):
        state = (0.1 * tick, 0.5 - 0.1 * tick)
        assert per_degree.command(tick, state) == pytest.approx(per_radian.command(tick, state))


def test_each_motor_is_clamped_on_its_own() -> None:
    pid = Pid(in_volts_per_rad(100.0), steady(0.0), TICK_S, volts_max=4.0, normal_force_volts=2.0)
    assert pid.command(0, (-1.0, 0.0)) == (4.0, -4.0)
    assert pid.command(1, (1.0, 0.0)) == (-4.0, 4.0)
    assert pid.command(2, (-0.07, 0.0)) == pytest.approx((4.0, -2.5))


@pytest.mark.parametrize(("anti_windup", "expected_volts"), [("conditional", 0.0), ("none", 5.0)])
def test_while_saturated_only_the_plain_integral_winds_up(
    anti_windup: AntiWindup, expected_volts: float
) -> None:
    pid = Pid(in_volts_per_rad(20.0, 5.0), steady(1.0), TICK_S, anti_windup=anti_windup)
    for tick in range(100):
        assert pid.command(tick, (0.0, 0.0)) == (5.0, -5.0)
    assert pid.integrals[0] == pytest.approx(expected_volts)


@pytest.mark.parametrize("share", [1.0, -1.0])
@pytest.mark.parametrize(
    ("conditional", "error", "integral", "expected"),
    [
        (True, 0.5, 0.0, 0.5),  # the set-point of the other loop is not at its limit
        (True, 1.0, 0.0, 0.0),  # at its limit
        (True, -0.5, 2.0, 1.5),  # beyond it, and on the way back
        (True, -1.0, -3.0, -3.0),
        (False, 1.0, 0.0, 1.0),
    ],
)
def test_an_integral_rests_while_the_set_point_that_it_moves_is_at_its_limit(
    share: float, conditional: bool, error: float, integral: float, expected: float
) -> None:
    outer = PidConstants(1.0, 1.0, 0.0, (0.0,), conditional, steers=1, share=share, most=0.8)
    inner = PidConstants(1.0, 0.0, 0.0, (1.0,), conditional)
    integrals, wanted = [integral, 0.0], [0.0]
    assert pid_command((outer, inner), integrals, [error, 0.0], [0.0, 0.0], [9.0], wanted)
    assert integrals == [expected, 0.0]
    assert wanted == [share * max(-0.8, min(error + integral, 0.8))]


def test_while_saturated_the_integral_may_still_leave_saturation() -> None:
    # Saturated upwards by the rate term while the error asks for less.
    pid = Pid(in_volts_per_rad(1.0, 5.0, 20.0), steady(0.0), TICK_S)
    assert pid.command(0, (0.5, -1.0)) == (5.0, -5.0)
    assert pid.integrals[0] == pytest.approx(-5.0 * 0.5 * TICK_S)


def test_one_saturated_motor_does_not_stop_the_integral() -> None:
    pid = Pid(in_volts_per_rad(1.0, 5.0), steady(1.0), TICK_S, normal_force_volts=10.0)
    assert pid.command(0, (0.0, 0.0)) == (5.0, 4.5)
    assert pid.integrals[0] == pytest.approx(5.0 * TICK_S)


def test_ticks_must_rise_and_a_gap_counts_as_one_tick() -> None:
    pid = Pid(in_volts_per_rad(1.0, 1.0), steady(1.0), TICK_S)
    pid.command(5, (0.0, 0.0))
    with pytest.raises(ValueError, match="tick is 5; it must be above the last one, 5"):
        pid.command(5, (0.0, 0.0))
    pid.command(500, (0.0, 0.0))
    assert pid.integrals[0] == pytest.approx(0.02)


def test_a_state_that_is_not_finite_changes_nothing() -> None:
    pid = Pid(in_volts_per_rad(1.0, 1.0), steady(1.0), TICK_S)
    with pytest.raises(ValueError, match="tick 0"):
        pid.command(0, (math.nan, 0.0))
    assert pid.integrals[0] == 0.0
    assert pid.command(0, (0.0, 0.0)) == (0.5, -0.5)


def test_impossible_settings_are_refused_by_name() -> None:
    with pytest.raises(ValueError, match="integral is -1"):
        in_volts_per_rad(1.0, -1.0)
    with pytest.raises(ValueError, match="'V/turn'"):
        Pid(PidGains(1.0, 0.0, 0.0, unit="V/turn"), steady(0.0), TICK_S)
    with pytest.raises(ValueError, match="volts_max is 0"):
        Pid(PAPER_GAINS, steady(0.0), TICK_S, volts_max=0.0)
    with pytest.raises(ValueError, match="tick_s is -1"):
        Pid(PAPER_GAINS, steady(0.0), -1.0)
    with pytest.raises(ValueError, match="anti_windup is 'off'"):
        Pid(PAPER_GAINS, steady(0.0), TICK_S, anti_windup="off")  # type: ignore[arg-type]


@dataclass(frozen=True, slots=True)
class HalfPeriod:
    """One level of the square wave, angles mirrored so that the level is +amplitude."""

    overshoot_rad: float
    settled_after_s: float


def fly(gains: PidGains, half_periods: int, band: float) -> list[HalfPeriod]:
    """Fly the paper's square wave with the true state; `band` is a share of the amplitude."""
    plant = PitchPlant(PitchParameters(), TICK_S)
    controller: Controller = Pid(gains, Square(AMPLITUDE_RAD, 25.0, TICK_S), TICK_S)
    results = []
    for half_period in range(half_periods):
        sign = -1.0 if half_period % 2 else 1.0
        first = half_period * HALF_PERIOD_TICKS
        errors = []
        for tick in range(first, first + HALF_PERIOD_TICKS):
            assert controller.references(tick) == (sign * AMPLITUDE_RAD,)
            plant.advance(controller.command(tick, plant.state))
            errors.append(sign * plant.angle_rad - AMPLITUDE_RAD)
        outside = [n for n, error in enumerate(errors, 1) if abs(error) > band * AMPLITUDE_RAD]
        results.append(HalfPeriod(max(errors), outside[-1] * TICK_S))
    return results


def test_with_the_papers_gains_per_degree_the_pitch_follows_the_square_wave() -> None:
    first, *others = fly(PAPER_GAINS, half_periods=6, band=0.05)
    # Measured: 8.6 s and 9.2 ... 9.6 s of the 12.5 s between switches. The overshoot, 31 % and
    # 46 ... 48 % of the amplitude, is what Ziegler-Nichols tuning is known for.
    assert first.settled_after_s < 9.0
    assert 0.45 < first.overshoot_rad < 0.55
    assert all(half_period.settled_after_s < 10.0 for half_period in others)
    assert all(0.65 < half_period.overshoot_rad < 0.80 for half_period in others)


def test_with_the_same_gains_per_radian_it_never_gets_there() -> None:
    # The unit trap: the paper prints no unit, and radians look natural.
    per_radian = PidGains(0.1, 0.053, 0.12, unit="V/rad")
    for half_period in fly(per_radian, half_periods=6, band=0.05):
        # Measured: the pitch gets to 0.36 ... 0.55 rad of 1.57 before the reference switches.
        assert 0.3 < AMPLITUDE_RAD + half_period.overshoot_rad < 0.6
        assert half_period.settled_after_s == HALF_PERIOD_TICKS * TICK_S
