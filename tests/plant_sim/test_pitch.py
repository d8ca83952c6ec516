"""The pitch plant against an independent integrator, and its motors against the exact lag."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

from plant_sim.disturbance import StepTorque
from plant_sim.pitch import PitchParameters, PitchPlant, pitch_constants, pitch_step
from plant_sim.plant import Plant

PAPER = PitchParameters()
HOLD_S = 0.48
# Held voltages (front, rear): reversals, a pause, and values beyond the clamp.
MANOEUVRE = ((4.0, -4.0), (-3.0, 2.0), (0.0, 0.0), (7.0, -9.0), (1.0, 3.0), (-5.0, 5.0), (2.0, 0.0))


def slope(
    _time: float, state: np.ndarray, volts: tuple[float, float], parameters: PitchParameters
) -> list[float]:
    theta, omega, front, rear = state
    acceleration = (
        parameters.torque_gain_rad_per_v_s2 * (front - rear)
        - parameters.rate_damping_per_s * omega
        - parameters.stiffness_per_s2 * math.sin(theta - parameters.equilibrium_rad)
    )
    return [
        omega,
        acceleration,
        (volts[0] - front) / parameters.motor_lag_s,
        (volts[1] - rear) / parameters.motor_lag_s,
    ]


def reference_manoeuvre() -> np.ndarray:
    from scipy.integrate import solve_ivp

    state = np.array([0.3, -0.2, 0.0, 0.0])
    for volts in MANOEUVRE:
        clamped = (min(max(volts[0], -5.0), 5.0), min(max(volts[1], -5.0), 5.0))
        state = solve_ivp(
            slope, (0.0, HOLD_S), state, "DOP853", rtol=1e-12, atol=1e-14, args=(clamped, PAPER)
        ).y[:, -1]
    return state


def stepped_manoeuvre(step_s: float) -> tuple[float, float, float, float]:
    constants = pitch_constants(PAPER, step_s)
    state = (0.3, -0.2, 0.0, 0.0)
    for volts in MANOEUVRE:
        for _ in range(round(HOLD_S / step_s)):
            state = pitch_step(state, volts, (0.0,), constants)
    return state


def test_halving_the_step_shows_order_four() -> None:
    exact = reference_manoeuvre()
    errors = [
        max(abs(stepped_manoeuvre(step_s)[i] - exact[i]) for i in (0, 1))
        for step_s in (0.04, 0.02, 0.01, 0.005)
    ]
    orders = [math.log2(coarse / fine) for coarse, fine in pairwise(errors)]
    assert all(3.7 <= order <= 4.5 for order in orders), (orders, errors)


def test_at_the_control_tick_the_error_is_far_below_an_encoder_count() -> None:
    exact = reference_manoeuvre()
    state = stepped_manoeuvre(0.01)
    assert abs(state[0] - exact[0]) < 1e-7
    assert abs(state[1] - exact[1]) < 1e-7


def test_motor_lag_is_exact_for_held_voltages_whatever_the_step() -> None:
    for steps in (1, 7, 100):
        constants = pitch_constants(PAPER, 0.35 / steps)
        state = (0.0, 0.0, 1.0, -2.0)
        for _ in range(steps):
            state = pitch_step(state, (3.0, -0.5), (0.0,), constants)
        left = math.exp(-0.35 / 0.08)
        assert state[2] == pytest.approx(3.0 + (1.0 - 3.0) * left, rel=1e-12)
        assert state[3] == pytest.approx(-0.5 + (-2.0 + 0.5) * left, rel=1e-12)


def test_front_pitches_up_and_rear_down() -> None:
    at_rest = PitchParameters(equilibrium_rad=0.0)
    front, rear = PitchPlant(at_rest, 0.01), PitchPlant(at_rest, 0.01)
    for _ in range(20):
        front.advance((2.0, 0.0))
        rear.advance((0.0, 2.0))
    assert front.angle_rad > 0.001
    assert rear.angle_rad == -front.angle_rad


def test_voltages_beyond_the_clamp_act_as_the_clamp() -> None:
    beyond, at_limit = PitchPlant(PAPER, 0.01), PitchPlant(PAPER, 0.01)
    below = PitchPlant(PAPER, 0.01)
    for _ in range(50):
        beyond.advance((1e6, -80.0))
        at_limit.advance((5.0, -5.0))
        below.advance((4.9, -5.0))
    assert beyond.state == at_limit.state
    assert below.state != at_limit.state


def test_left_alone_the_pitch_settles_at_the_equilibrium() -> None:
    plant = PitchPlant(PAPER, 0.01, initial_angle_rad=0.4, initial_rate=0.1)
    for _ in range(20_000):
        plant.advance((0.0, 0.0))
    assert plant.angle_rad == pytest.approx(-0.115, abs=1e-4)
    assert plant.rate_rad_s == pytest.approx(0.0, abs=1e-4)


def test_torque_acts_on_the_steps_the_disturbance_names() -> None:
    free = PitchParameters(rate_damping_per_s=0.0, stiffness_per_s2=0.0)
    plant = PitchPlant(free, 0.01, StepTorque(0.02, 0.5, 0.01, end_s=0.05))
    rates = []
    for _ in range(7):
        plant.advance((0.0, 0.0))
        rates.append(plant.rate_rad_s)
    assert rates == pytest.approx([0.0, 0.0, 0.005, 0.010, 0.015, 0.015, 0.015], abs=1e-15)


def test_mismatch_scales_damping_stiffness_and_gain_only() -> None:
    assert PAPER.mismatched(0.1) == PitchParameters(0.1 * 1.1, 0.5 * 1.1, 0.35 * 1.1)
    assert PAPER.mismatched((-0.5, 1.0, 0.0)) == PitchParameters(0.05, 1.0, 0.35)


def test_plant_starts_at_rest_and_measures_its_angle() -> None:
    plant: Plant = PitchPlant(PAPER, 0.01)
    assert plant.measured == (0.0,)
    moved = PitchPlant(PAPER, 0.01, initial_angle_rad=0.2, initial_rate=-0.3)
    assert moved.state == (0.2, -0.3, 0.0, 0.0)
    assert moved.measured == (0.2,)


@pytest.mark.parametrize(
    ("volts", "message"),
    [((1.0,), "1 voltages"), ((1.0, 2.0, 3.0), "3 voltages"), ((math.nan, 0.0), "finite")],
)
def test_unusable_voltages_are_refused_and_leave_the_plant(
    volts: tuple[float, ...], message: str
) -> None:
    plant = PitchPlant(PAPER, 0.01)
    before = plant.state
    with pytest.raises(ValueError, match=message):
        plant.advance(volts)
    assert plant.state == before


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("rate_damping_per_s", -0.1),
        ("stiffness_per_s2", math.nan),
        ("torque_gain_rad_per_v_s2", math.inf),
        ("motor_lag_s", 0.0),
        ("volts_max", -5.0),
    ],
)
def test_impossible_parameters_are_refused_by_name(name: str, value: float) -> None:
    with pytest.raises(ValueError, match=f"{name} is {value}"):
        PitchParameters(**{name: value})


def test_impossible_step_and_start_are_refused() -> None:
    with pytest.raises(ValueError, match="step_s is 0"):
        PitchPlant(PAPER, 0.0)
    with pytest.raises(ValueError, match="initial_rate is inf"):
        PitchPlant(PAPER, 0.01, initial_rate=math.inf)
