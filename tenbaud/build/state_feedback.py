"""State feedback for a model: its gains as given, or designed as a linear-quadratic regulator.

The design runs at the receiver and is no part of the codec, so it may use a library. Gains are rounded
to ten digits, so that a replay on a machine with another library computes the same commands.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import scipy

from channel.codec.codec import Model
from channel.codec.laws import FeedbackLaw, Rows
from channel.codec.models.learned import plant_model
from channel.codec.signals import Signal, Signals, signals_of
from receiver.controllers.base import ControllerContext
from receiver.controllers.state_feedback import StateFeedback
from tenbaud.bounds.linear import unreached
from tenbaud.config.controllers import StateFeedbackSection
from tenbaud.config.load import ConfigError
from tenbaud.config.schema import FlightConfig

Matrix = npt.NDArray[np.float64]
FIELD = "receiver.state_feedback"
STEP = 1e-5
"""By which states and inputs are moved for the derivatives."""
HELD_ERROR_MAX = 1e-6
UNSTABLE = 1.0 - 1e-9
GROWING = 1.0 + 1e-6


def state_feedback(config: FlightConfig, context: ControllerContext) -> StateFeedback:
    """Return the controller of a configuration; ConfigError, with names, for one that cannot be."""
    whole, model = context.model, plant_model(context.model)
    # What a model learns is no state of its plant, and is not fed back.
    learned = (0.0,) * (whole.state_size - model.state_size)
    context = replace(context, model=model, signals=signals_of(model))
    section, signals = config.receiver.state_feedback, context.signals
    plant = Linear(model, context.initial_command)
    law = _law(section, plant, context)
    steered = [one is not None for one in context.references]
    base, forward = _set_points(plant, law[0], steered, signals)
    return StateFeedback(
        FeedbackLaw(
            _rounded(base[None])[0],
            tuple([(*row, *learned) for row in _rounded(law[0])]),
            _rounded(forward),
            _rounded(law[1]),
            section.anti_windup == "conditional",
        ),
        context.references,
        whole.measured,
        context.command_max,
        context.tick_s,
    )


class Linear:
    """A model about an operating point: x' = A x + B u, y = C x, and `drift` in a tick.

    The point is the model's own, or else its initial state and a command.
    """

    def __init__(self, model: Model, command: Sequence[float]) -> None:
        initial, command = getattr(model, "operating", None) or (model.initial(), command)
        self.state = np.array(initial)
        self.command = np.array(command)
        self.outputs = np.array(model.measured(initial))
        nothing = (0.0,) * model.correction_size

        def tick(values: Matrix) -> Matrix:
            state, inputs = values[: model.state_size], values[model.state_size :]
            return np.array(model.tick(tuple(state.tolist()), tuple(inputs.tolist()), nothing))

        def measured(values: Matrix) -> Matrix:
            return np.array(model.measured(tuple(values[: model.state_size].tolist())))

        at = np.concatenate([self.state, self.command])
        self.drift = tick(at) - self.state
        steps = STEP * np.eye(len(at))
        moved = [(tick(at + one) - tick(at - one)) / (2.0 * STEP) for one in steps]
        seen = [(measured(at + one) - measured(at - one)) / (2.0 * STEP) for one in steps]
        size = model.state_size
        self.a: Matrix = np.array(moved[:size]).T
        self.b: Matrix = np.array(moved[size:]).reshape(len(at) - size, size).T
        self.c: Matrix = np.array(seen[:size]).T


def _law(
    section: StateFeedbackSection, plant: Linear, context: ControllerContext
) -> tuple[Matrix, Matrix]:
    signals = context.signals
    inputs, states, outputs = (len(one) for one in (signals.inputs, signals.states, signals.outputs))
    if not section.gains:
        return _designed(section, plant, context)
    gains = _given("gains", section.gains, inputs, states)
    if not section.integral_gains:
        _require_held(plant.a - plant.b @ gains, signals)
        return gains, np.zeros((inputs, outputs))
    return gains, _given("integral_gains", section.integral_gains, inputs, outputs)


def _require_held(loop: Matrix, signals: Signals) -> None:
    """Raise ConfigError for gains under which a motion grows."""
    values, vectors = np.linalg.eig(loop)
    largest = int(np.argmax(np.abs(values)))
    if abs(values[largest]) > GROWING:
        most = signals.states[int(np.argmax(np.abs(vectors[:, largest])))].name
        raise ConfigError(
            f"{FIELD}.gains do not hold the plant: under u = -K x a motion grows by the factor "
            f"{abs(values[largest]):.6g} per tick, mostly of {most}; look at the signs and units of K"
        )


def _given(name: str, rows: Rows, height: int, width: int) -> Matrix:
    if len(rows) != height or {len(row) for row in rows} != {width}:
        raise ConfigError(
            f"{FIELD}.{name} has {len(rows)} row(s) of {', '.join(str(len(row)) for row in rows)} "
            f"numbers; the model has {height} input(s), a row each, and a row needs {width}"
        )
    return np.array(rows, dtype=np.float64)


def _designed(
    section: StateFeedbackSection, plant: Linear, context: ControllerContext
) -> tuple[Matrix, Matrix]:
    signals, size = context.signals, len(context.signals.states)
    weights = _weights("state_weights", section.state_weights, signals.states, 0.0)
    state_costs = np.diag(weights)
    if not section.state_weights:
        state_costs = plant.c.T @ plant.c
    input_costs = np.diag(_weights("input_weights", section.input_weights, signals.inputs, 1.0))
    integral = _weights("integral_weights", section.integral_weights, signals.outputs, 0.0)
    integrated = np.flatnonzero(integral)
    count = len(integrated)
    a = np.block(
        [
            [plant.a, np.zeros((size, count))],
            [-context.tick_s * plant.c[integrated], np.eye(count)],
        ]
    )
    b = np.vstack([plant.b, np.zeros((count, plant.b.shape[1]))])
    q = np.block(
        [
            [state_costs, np.zeros((size, count))],
            [np.zeros((count, size)), np.diag(integral[integrated])],
        ]
    )
    _require_controllable(a, b, signals)
    try:
        p = scipy.linalg.solve_discrete_are(a, b, q, input_costs)
    except (scipy.linalg.LinAlgError, ValueError) as error:
        raise ConfigError(
            f"{FIELD}: no regulator for these weights: {error}; give every state that must come to "
            "rest a weight in state_weights"
        ) from error
    k = np.linalg.solve(input_costs + b.T @ p @ b, b.T @ p @ a)
    k_i = np.zeros((len(signals.inputs), len(signals.outputs)))
    k_i[:, integrated] = -k[:, size:]
    return k[:, :size], k_i


def _require_controllable(a: Matrix, b: Matrix, signals: Signals) -> None:
    """Raise ConfigError where a motion that does not die away is out of reach of the inputs."""
    names = [*(one.name for one in signals.states), *["an integral"] * len(a)]
    if found := unreached(a, b, UNSTABLE):
        value, place = found
        raise ConfigError(
            f"{FIELD}: the input(s) {', '.join(one.name for one in signals.inputs)} do not reach a "
            f"motion with the eigenvalue {abs(value):.6g} per tick, mostly of {names[place]}: the pair "
            "(A, B) is not controllable"
        )


def _set_points(
    plant: Linear, gains: Matrix, steered: Sequence[bool], signals: Signals
) -> tuple[Matrix, Matrix]:
    """Return base and F: what holds the plant at its set-points, smallest inputs first."""
    chosen = np.flatnonzero(steered)
    size, inputs = plant.b.shape
    held = np.block(
        [[plant.a - np.eye(size), plant.b], [plant.c[chosen], np.zeros((len(chosen), inputs))]]
    )
    wanted = np.zeros((size + len(chosen), 1 + len(chosen)))
    wanted[:size, 0] = -plant.drift
    wanted[size:, 0] = -plant.outputs[chosen]
    wanted[size:, 1:] = np.eye(len(chosen))
    found = np.linalg.pinv(held, rcond=1e-10) @ wanted
    left = np.abs(held @ found - wanted).max(axis=0)
    for column, place in enumerate(chosen, 1):
        if left[column] > HELD_ERROR_MAX:
            raise ConfigError(
                f"receiver.reference: no command holds the output {signals.outputs[place].name} at a "
                "set-point beside the others; give fewer outputs a reference"
            )
    states, commands = found[:size], found[size:]
    total = commands + gains @ states
    base = plant.command + gains @ plant.state + total[:, 0]
    forward = np.zeros((inputs, len(steered)))
    forward[:, chosen] = total[:, 1:]
    return base, forward


def _weights(name: str, given: Mapping[str, float], signals: Sequence[Signal], usual: float) -> Matrix:
    names = [one.name for one in signals]
    for one in given:
        if one not in names:
            raise ConfigError(f"{FIELD}.{name}.{one}: the names here are {', '.join(names)}")
    return np.array([given.get(one, usual) for one in names])


def _rounded(matrix: Matrix) -> Rows:
    return tuple(tuple(float(f"{value:.10g}") for value in row) for row in matrix.tolist())
