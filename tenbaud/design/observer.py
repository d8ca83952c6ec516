"""The transmitter's observer of a plant: the steady Kalman filter behind its encoders.

Of a model that is not linear the gains are those at its rest; its own prediction stays what it is.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy

from channel.codec.codec import STATE_MAX, Codec, Model
from channel.codec.coders.direction import DirectionCoder
from channel.codec.coders.learning import LearningCoder
from channel.codec.models.learned import plant_model
from channel.codec.models.linear import LinearModel
from plant_sim.zero_order_hold import van_loan
from tenbaud.bounds.linear import Matrix
from tenbaud.config.schema import FlightConfig
from tenbaud.design.described import plant_of
from tenbaud.design.plant import rows_of
from transmitter.session.state_observer import StateObserver

LEAST_STEP = 1e-6
"""of an output that is read exactly"""
LEAST_NOISE = 1e-9
"""of every state, as a share of the largest: a state that no noise reaches is still looked at"""


def linear_observer(
    plant: LinearModel, tick_noise: Matrix, steps: Matrix, model: Model | None = None
) -> StateObserver:
    """Return the observer of a linear model, or of one that learns beside it; see `kalman_observer`."""
    transition = np.array(plant.constants.transition).reshape(plant.state_size, plant.state_size)
    return kalman_observer(model or plant, transition, np.array(plant.outputs), tick_noise, steps)


def kalman_observer(
    model: Model, transition: Matrix, C: Matrix, tick_noise: Matrix, steps: Matrix
) -> StateObserver:
    """Return the observer for a noise covariance per tick and the step of each output's encoder.

    `transition` is that of a tick, `C` makes outputs of states. States of the model beyond these, such
    as lagging motors, follow from the commands alone; what a model learns stays zero here.
    """
    size, outputs = len(transition), len(C)
    known = np.zeros((model.state_size - size, outputs))
    seen = np.diag(np.maximum(np.broadcast_to(steps, (outputs,)), LEAST_STEP) ** 2 / 12.0)
    noise = tick_noise + LEAST_NOISE * float(np.trace(tick_noise)) * np.eye(size)
    try:
        ahead = scipy.linalg.solve_discrete_are(transition.T, C.T, noise, seen)
    except (np.linalg.LinAlgError, ValueError) as error:
        raise ValueError(
            f"the outputs do not show every state, so none is observed: {error}"
        ) from error
    gains: Matrix = ahead @ C.T @ np.linalg.inv(C @ ahead @ C.T + seen)
    return StateObserver(
        model,
        rows_of(np.vstack([gains, known])),
        rows_of(np.vstack([np.linalg.pinv(C), known])),
        (STATE_MAX,) * model.state_size,
    )


def observer_of_coder(codec: Codec, counts_per_turn: int) -> StateObserver:
    """Return the observer for the disturbance that a coder assumes."""
    plant, coder = plant_model(codec.model), codec.coder
    known = isinstance(coder, DirectionCoder | LearningCoder)
    if not (isinstance(plant, LinearModel) and known):
        raise ValueError(
            "a coder that uses rates needs to be `direction` or `learning` where the model is linear"
        )
    parameters: Any = coder.parameters  # type: ignore[attr-defined]
    both = np.sum(getattr(parameters, "noises", None) or [parameters.noise], axis=0)
    noise = np.zeros((plant.state_size, plant.state_size))
    corrected = plant.correction_size
    noise[:corrected, :corrected] = both / codec.ticks_per_sample
    return linear_observer(plant, noise, np.array([math.tau / counts_per_turn]), codec.model)


def configured_observer(model: Model, config: FlightConfig, steps: Sequence[float]) -> StateObserver:
    """Return the observer for a configuration's disturbance and the steps of its encoders."""
    tick_s = config.timing.tick_s
    plant = plant_of(config.model, tick_s)
    if plant is None:
        raise ValueError(f"model.kind = {config.model.kind!r} describes no plant to observe")
    transition, noise = van_loan(plant.A, plant.noise, tick_s)
    if isinstance(found := plant_model(model), LinearModel):
        return linear_observer(found, noise, np.array(steps), model)
    return kalman_observer(model, transition, plant.C, noise, np.array(steps))
