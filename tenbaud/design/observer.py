"""The transmitter's observer of a linear model: the steady Kalman filter behind its encoders."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.linalg import solve_discrete_are

from channel.codec.codec import STATE_MAX, Codec
from channel.codec.coders.direction import DirectionCoder
from channel.codec.models.linear import LinearModel
from tenbaud.bounds.linear import Matrix, van_loan
from tenbaud.config.schema import FlightConfig
from tenbaud.design.described import plant_of
from tenbaud.design.plant import rows_of
from transmitter.session.state_observer import StateObserver

LEAST_STEP = 1e-6
"""of an output that is read exactly"""
LEAST_NOISE = 1e-9
"""of every state, as a share of the largest: a state that no noise reaches is still looked at"""


def kalman_observer(model: LinearModel, tick_noise: Matrix, steps: Matrix) -> StateObserver:
    """Return the observer for a noise covariance per tick and the step of each output's encoder."""
    size, outputs = model.state_size, len(model.outputs)
    transition = np.array(model.constants.transition).reshape(size, size)
    C = np.array(model.outputs)
    seen = np.diag(np.maximum(np.broadcast_to(steps, (outputs,)), LEAST_STEP) ** 2 / 12.0)
    noise = tick_noise + LEAST_NOISE * float(np.trace(tick_noise)) * np.eye(size)
    try:
        ahead = solve_discrete_are(transition.T, C.T, noise, seen)
    except (np.linalg.LinAlgError, ValueError) as error:
        raise ValueError(
            f"the outputs do not show every state, so none is observed: {error}"
        ) from error
    gains = ahead @ C.T @ np.linalg.inv(C @ ahead @ C.T + seen)
    return StateObserver(model, rows_of(gains), rows_of(np.linalg.pinv(C)), (STATE_MAX,) * size)


def observer_of_coder(codec: Codec, counts_per_turn: int) -> StateObserver:
    """Return the observer for the disturbance that a coder assumes."""
    model, coder = codec.model, codec.coder
    if not (isinstance(model, LinearModel) and isinstance(coder, DirectionCoder)):
        raise ValueError(
            "a coder that uses rates needs the coder `direction` where the model is linear"
        )
    noise = np.zeros((model.state_size, model.state_size))
    corrected = model.correction_size
    noise[:corrected, :corrected] = np.array(coder.parameters.noise) / codec.ticks_per_sample
    return kalman_observer(model, noise, np.array([math.tau / counts_per_turn]))


def configured_observer(
    model: LinearModel, config: FlightConfig, steps: Sequence[float]
) -> StateObserver:
    """Return the observer for a configuration's disturbance and the steps of its encoders."""
    tick_s = config.timing.tick_s
    plant = plant_of(config.model, tick_s)
    if plant is None:
        raise ValueError(f"model.kind = {config.model.kind!r} describes no linear plant to observe")
    _, noise = van_loan(plant.A, plant.noise, tick_s)
    return kalman_observer(model, noise, np.array(steps))
