"""One tick of the codec in plain Python, beside the same step written with numpy."""

from __future__ import annotations

import timeit

import numpy as np
from numpy.typing import NDArray

from benchmarks.figures import Figure
from tenbaud.build.codec import build_codec
from tenbaud.config.load import load_config
from tenbaud.config.models import PitchModelSection

SAMPLES = 300
ROUNDS = 15


def codec_figures() -> list[Figure]:
    """Return microseconds per tick of the codec, and of a numpy version of its model step."""
    config = load_config("paper-10baud")
    codec = build_codec(config)
    ticks = codec.ticks_per_sample
    commands = [(1.25, -1.25)] * ticks

    def fly() -> None:
        state = codec.initial()
        for sample in range(SAMPLES):
            state = codec.step(state, (1 if sample % 3 else -1,), commands)
            codec.digest(state)

    plain_us = min(timeit.repeat(fly, number=1, repeat=ROUNDS)) / (SAMPLES * ticks) * 1e6

    p = config.model
    assert isinstance(p, PitchModelSection), "the preset flies the pitch model"
    state = np.array([0.3, 0.1, 1.0, -1.0])
    held = np.array([0.02, 0.04, 0.0, 0.0])
    volts = np.array([1.25, -1.25])
    h = config.timing.tick_s

    def derivative(x: NDArray[np.float64]) -> NDArray[np.float64]:
        torque = p.torque_gain_rad_per_v_s2 * (x[2] - x[3])
        stiffness = p.stiffness_per_s2 * np.sin(x[0] - p.equilibrium_rad)
        rate = -p.rate_damping_per_s * x[1] - stiffness + torque
        lag = (volts - x[2:]) / p.motor_lag_s
        slopes: NDArray[np.float64] = np.concatenate(([x[1], rate], lag)) + held
        return slopes

    def numpy_tick() -> None:
        k1 = derivative(state)
        k2 = derivative(state + 0.5 * h * k1)
        k3 = derivative(state + 0.5 * h * k2)
        k4 = derivative(state + h * k3)
        state + h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)

    numpy_us = min(timeit.repeat(numpy_tick, number=200, repeat=ROUNDS)) / 200 * 1e6
    return [
        Figure("codec_tick_us", plain_us, "us", "at most 8"),
        Figure("codec_tick_numpy_us", numpy_us, "us", "the same step with numpy, for comparison"),
        Figure("codec_numpy_over_plain", numpy_us / plain_us, "times", ""),
    ]
