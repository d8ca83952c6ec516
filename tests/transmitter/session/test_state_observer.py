"""The transmitter's observer of the rate."""

from __future__ import annotations

import math

import numpy as np
import pytest

from channel.codec.models.linear import LinearModel
from channel.codec.models.pitch import PitchModel, PitchParameters
from plant_sim.disturbance import WhiteTorque
from plant_sim.encoder import Encoder
from plant_sim.pitch import PitchParameters as PlantParameters
from plant_sim.pitch import PitchPlant
from plant_sim.zero_order_hold import discretised, van_loan
from tenbaud.design.described import plant_of, plant_section
from tenbaud.design.observer import linear_observer
from tests.channel.codec.two_axes import TwoAxes
from transmitter.session.state_observer import StateObserver, rate_observer

TICK_S = 0.01
STEP = math.tau / 4096
MODEL = PitchModel(PitchParameters(), TICK_S)


def fly(bandwidth_rad_s: float, ticks: int = 6000, missing: range = range(0)) -> float:
    """Return the rms error of the rate over the second half, behind an encoder of 4096 counts."""
    plant = PitchPlant(PlantParameters(), TICK_S, WhiteTorque(2e-3, TICK_S, 3))
    encoder = Encoder(4096)
    observer = rate_observer(MODEL, TICK_S, bandwidth_rad_s)
    volts = (0.0, 0.0)
    total = 0.0
    for tick in range(ticks):
        if tick not in missing:
            seen = observer.look(tick, (encoder.angle_rad(encoder.counts(plant.angle_rad)),), volts)
        if tick >= ticks // 2:
            total += (seen[1] - plant.rate_rad_s) ** 2
        volts = (2.0 * math.sin(0.01 * tick), -2.0 * math.sin(0.013 * tick))
        plant.advance(volts)
    return math.sqrt(total / (ticks - ticks // 2))


def test_when_counts_are_all_there_is_then_the_rate_is_far_better_than_their_differences() -> None:
    differences = math.tau / 4096 / math.sqrt(6.0) / TICK_S
    assert fly(30.0) < 0.25 * differences
    assert fly(30.0) < fly(300.0)
    assert fly(30.0) < fly(2.0)


def test_when_ticks_are_missed_then_the_rate_is_found_again() -> None:
    assert fly(30.0, missing=range(1500, 1700)) == pytest.approx(fly(30.0), rel=0.05)


def test_when_the_encoder_jumps_wildly_then_the_rate_stays_a_rate() -> None:
    observer = rate_observer(MODEL, TICK_S, 200.0)
    observer.look(0, (0.0,), (0.0, 0.0))
    for tick in range(1, 20):
        angle, rate = observer.look(tick, (1e4 * (-1) ** tick,), (0.0, 0.0))
        assert abs(rate) < 1e3
        assert math.isfinite(angle)


def fly_aero(observer: StateObserver, model: LinearModel, noise: np.ndarray, gap: range) -> np.ndarray:
    """Return the rms error of each state over the second half, both axes behind encoders."""
    rng = np.random.default_rng(5)
    root = np.linalg.cholesky(noise + 1e-16 * np.eye(4))
    state, errors = np.zeros(4), []
    commands: tuple[float, ...] = (0.0, 0.0)
    for tick in range(4000):
        if tick not in gap:
            outputs = tuple(round(state[axis] / STEP) * STEP for axis in (0, 2))
            seen = observer.look(tick, outputs, commands)
        errors.append(np.array(seen) - state)
        commands = (2.0 * math.sin(0.01 * tick), -2.0 * math.sin(0.013 * tick))
        moved = model.tick(tuple(state.tolist()), commands, (0.0,) * 4)
        state = np.array(moved) + root @ rng.standard_normal(4)
    return np.sqrt(np.mean(np.square(errors[2000:]), axis=0))


def test_when_two_axes_are_seen_then_the_kalman_filter_finds_all_states() -> None:
    plant = plant_of(plant_section("aero"), TICK_S)
    assert plant is not None
    transition, drive = discretised(plant.A, plant.B, TICK_S)
    model = LinearModel(transition.tolist(), drive.tolist(), plant.C.tolist(), TICK_S)
    _, noise = van_loan(plant.A, plant.noise, TICK_S)
    found = fly_aero(linear_observer(model, noise, np.array([STEP])), model, noise, range(0))
    assert (found[[0, 2]] < STEP).all()
    assert (found[[1, 3]] < 0.25 * STEP / TICK_S).all()
    again = fly_aero(linear_observer(model, noise, np.array([STEP])), model, noise, range(900, 1000))
    assert np.allclose(again, found, rtol=0.05)
    # Gains for ten times the disturbance, or a tenth, are worse.
    for share in (0.01, 100.0):
        other = fly_aero(
            linear_observer(model, share * noise, np.array([STEP])), model, noise, range(0)
        )
        assert (other[[1, 3]] > found[[1, 3]]).all()


def test_when_outputs_hide_a_state_then_no_observer_is_designed() -> None:
    model = LinearModel(((1.0, 0.0), (0.0, 2.0)), ((1.0,), (1.0,)), ((1.0, 0.0),), TICK_S)
    with pytest.raises(ValueError, match="do not show every state"):
        linear_observer(model, np.eye(2), np.array([STEP]))


def test_when_it_makes_no_sense_then_it_is_refused() -> None:
    with pytest.raises(ValueError, match="bandwidth"):
        rate_observer(MODEL, TICK_S, 0.0)
    with pytest.raises(ValueError, match="one measured angle"):
        rate_observer(TwoAxes(TICK_S), TICK_S)
