"""Step responses, against python-control's own figures and on set-points of every shape."""

from __future__ import annotations

import numpy as np
import pytest

from tenbaud.recording.steps import steps_of

TICK_S = 0.01


def second_order(damping: float, rate_rad_s: float, time_s: np.ndarray) -> np.ndarray:
    import control

    system = control.tf([rate_rad_s**2], [1.0, 2.0 * damping * rate_rad_s, rate_rad_s**2])
    return np.asarray(control.step_response(system, T=time_s).outputs)


@pytest.mark.parametrize("damping", [0.2, 0.5, 0.9, 1.5])
@pytest.mark.parametrize("size", [1.0, -0.3])
@pytest.mark.parametrize("band", [0.02, 0.05])
def test_a_second_order_response_has_the_figures_of_python_control(
    damping: float, size: float, band: float
) -> None:
    import control

    time_s = np.arange(2000) * TICK_S
    values = size * second_order(damping, 2.0, time_s)
    expected = control.step_info(values, T=time_s, yfinal=size, SettlingTimeThreshold=band)
    (step,) = steps_of(time_s, np.full(2000, size), values, band)
    assert step["rise_time_s"] == pytest.approx(expected["RiseTime"], abs=1e-9)
    assert step["settling_time_s"] == pytest.approx(expected["SettlingTime"], abs=1e-9)
    assert 100.0 * step["overshoot_fraction"] == pytest.approx(expected["Overshoot"], abs=1e-9)


def test_each_step_of_a_square_wave_is_measured_from_where_the_output_was() -> None:
    one = second_order(0.5, 4.0, np.arange(1000) * TICK_S)
    values = np.concatenate([one, 1.0 - 2.0 * one, -1.0 + 2.0 * one])
    reference = np.repeat([1.0, -1.0, 1.0], 1000)
    steps = steps_of(np.arange(3000) * TICK_S, reference, values)
    assert [step["time_s"] for step in steps] == [0.0, 10.0, 20.0]
    assert [step["to_value"] for step in steps] == [1.0, -1.0, 1.0]
    assert steps[1]["from_value"] == pytest.approx(1.0)
    for step in steps:
        assert step["overshoot_fraction"] == pytest.approx(0.163, abs=2e-3)
        assert step["rise_time_s"] == steps[0]["rise_time_s"]


def test_an_output_that_does_not_arrive_in_time_has_no_rise_and_does_not_settle() -> None:
    values = np.linspace(0.0, 0.6, 200)
    (step,) = steps_of(np.arange(200) * TICK_S, np.ones(200), values)
    assert (step["rise_time_s"], step["settling_time_s"]) == (None, None)
    assert step["overshoot_fraction"] == 0.0


@pytest.mark.parametrize(
    "reference",
    [
        np.sin(np.arange(600) * TICK_S),
        np.zeros(600),
        np.concatenate([np.arange(300) * TICK_S, np.full(300, 3.0)]),
        np.full(600, np.nan),
    ],
    ids=["sine", "constant zero", "ramp", "none"],
)
def test_a_set_point_that_does_not_jump_has_no_steps(reference: np.ndarray) -> None:
    assert steps_of(np.arange(600) * TICK_S, reference, np.full(600, 0.01)) == []


def test_a_set_point_that_is_known_some_ticks_later_jumps_then() -> None:
    reference = np.concatenate([np.full(4, np.nan), np.ones(996)])
    values = second_order(0.7, 3.0, np.arange(1000) * TICK_S)
    (step,) = steps_of(np.arange(1000) * TICK_S, reference, values)
    assert step["time_s"] == 0.04


def test_an_output_that_becomes_unknown_has_not_settled() -> None:
    values = second_order(0.7, 3.0, np.arange(1000) * TICK_S)
    values[900:] = np.nan
    (step,) = steps_of(np.arange(1000) * TICK_S, np.ones(1000), values)
    assert step["settling_time_s"] is None
    assert step["rise_time_s"] is not None


def test_a_step_from_an_unknown_output_is_left_out() -> None:
    values = second_order(0.7, 3.0, np.arange(1000) * TICK_S)
    values[0] = np.nan
    assert steps_of(np.arange(1000) * TICK_S, np.ones(1000), values) == []
    assert steps_of(np.arange(1000) * TICK_S, np.ones(1000), np.full(1000, np.nan)) == []


def test_a_recording_that_begins_in_flight_shows_no_first_step() -> None:
    values = np.concatenate([np.full(500, 0.9), second_order(0.7, 3.0, np.arange(1000) * TICK_S)])
    reference = np.concatenate([np.ones(500), np.full(1000, 2.0)])
    steps = steps_of(30.0 + np.arange(1500) * TICK_S, reference, values)
    assert [step["time_s"] for step in steps] == [35.0]
