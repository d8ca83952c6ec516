from __future__ import annotations

import math

import pytest

from transmitter.rigs.axes import Axis, Motors


def test_an_axis_has_its_own_scale_sign_and_zero() -> None:
    travel = Axis("travel", 0, 8192, 1, 100)
    elevation = Axis("elevation", 2, 4096, -1, None)
    assert travel.encoder((0, 0, 0)).angle_rad(100 + 8192 * 3) == pytest.approx(3 * math.tau)
    assert elevation.encoder((0, 0, 500)).angle_rad(500 + 1024) == pytest.approx(-math.pi / 2)


def test_a_jump_is_measured_against_rate_and_time() -> None:
    axis = Axis("pitch", 1, 4096, 1, 0)
    assert axis.jump_counts(math.tau, 1.0) == pytest.approx(4096 + 4)
    assert axis.jump_counts(20.0, 0.0) == pytest.approx(4)


def test_motor_volts_pass_and_dac_volts_are_divided_by_the_amplifier() -> None:
    assert Motors().to_device((3.0, -1.5)) == (3.0, -1.5)
    assert Motors((3.0, 3.0)).to_device((3.0, -1.5)) == (1.0, -0.5)


def test_the_device_gets_no_more_than_it_can_give() -> None:
    assert Motors(device_max=2.0).to_device((3.0, -3.0)) == (2.0, -2.0)


def test_outputs_may_be_crossed_turned_round_and_elsewhere() -> None:
    motors = Motors(channels=(3, 1), signs=(1, -1))
    assert motors.to_device((2.0, 1.0)) == (0.0, -1.0, 0.0, 2.0)
    assert motors.off() == (0.0, 0.0, 0.0, 0.0)
    assert Motors((1.0,), (0,), (1,)).to_device((2.0,)) == (2.0, 0.0), "one motor, two outputs"
