"""The model of several angles that is fitted to a record."""

from __future__ import annotations

import numpy as np
import pytest

from channel.flight_log import FlightLog
from reproduction.joint import fitted

TICK_S = 0.01


def test_the_motion_of_a_known_plant_gives_its_parameters_and_what_pushed_it() -> None:
    random = np.random.default_rng(1)
    rows = 6000
    commands = np.sin(0.02 * np.arange(rows))[:, None]
    state, angles = np.zeros(4), np.zeros((rows, 2))
    for row in range(rows):
        angles[row] = state[:2]
        push = random.normal(size=2) * np.sqrt(np.array([1e-5, 1e-3]) / TICK_S)
        travel, pitch = state[2:]
        acceleration = np.array([-0.5 * travel - 0.8 * state[1], -2.0 * state[1] - 0.6 * pitch])
        acceleration[1] += 1.5 * commands[row, 0]
        state = state + TICK_S * np.concatenate((state[2:], acceleration + push))
    counts = np.zeros((rows, 2), dtype=np.int64)
    model = fitted(FlightLog(TICK_S, angles, commands, counts), ["travel", "pitch"], ["motor"])
    A, B = np.array(model["A"]), np.array(model["B"])
    assert A[2] == pytest.approx([0.0, -0.8, -0.5, 0.0], abs=0.15)
    assert A[3] == pytest.approx([0.0, -2.0, 0.0, -0.6], abs=0.15)
    assert B[2:, 0] == pytest.approx([0.0, 1.5], abs=0.2)
    # The smoothing takes a part of what pushed, alike from every angle.
    assert np.log10(model["densities"]) == pytest.approx([-5.0, -3.0], abs=0.5)
