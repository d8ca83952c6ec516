"""The codec's own model, linear in outputs and rates: where a search for a better one begins."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from channel.codec.codec import Model, Vector
from plant_sim.identification.errors import IdentificationError
from plant_sim.identification.filters import Array
from plant_sim.identification.structures import COSINE, SINE, PitchStructure, Structure, names_of
from plant_sim.zero_order_hold import differences

ORDER_MAX = 2
NUDGE = 1e-4
CONDITION_MAX = 1e8
SETTLING = 400
"""ticks in which lags, such as those of motors, settle"""


@dataclass(frozen=True, slots=True, eq=False)
class Linearised:
    """z = (output, rate, output, rate ...) and the derivatives above it, near the model's start."""

    corrected: Array
    """as many states of the model there"""
    state: Array
    """z there"""
    by_corrected: Array
    """dz by these states"""
    by_state: Array
    """of the highest derivative of each output, by z"""
    by_input: Array
    force: Array
    """the highest derivatives without z and inputs"""


def linearised(model: Model, order: int, tick_s: float, command: Vector) -> Linearised:
    """Return the derivatives; IdentificationError where states do not determine outputs and rates."""
    if order > ORDER_MAX:
        raise IdentificationError(
            f"the structure is of order {order}: from the bits, structures up to order {ORDER_MAX} are "
            "identified"
        )
    size = order * len(model.measured(model.initial()))
    if size > model.correction_size:
        raise IdentificationError(
            f"outputs and rates of this structure are {size} numbers, and the codec's model has "
            f"{model.correction_size} states: ask for another structure"
        )
    start, held = np.array(model.initial()[:size]), np.array(command)

    def found(both: Array) -> Array:
        """Return z, then the highest derivative of each output."""
        derivatives = _derivatives(model, both[:size], both[size:], tick_s)[: order + 1]
        return np.concatenate((np.stack(derivatives[:-1], axis=1).ravel(), derivatives[-1]))

    at = np.concatenate((start, held))
    state, highest = np.split(found(at), [size])
    slopes = differences(found, at, np.full(len(at), NUDGE))
    by_corrected, turned, by_input = slopes[:size, :size], slopes[size:, :size], slopes[size:, size:]
    if np.linalg.cond(by_corrected) > CONDITION_MAX:
        raise IdentificationError(
            f"the first {size} states of the codec's model do not determine the outputs and rates "
            "of this structure: ask for another structure"
        )
    by_state = turned @ np.linalg.inv(by_corrected)
    force = highest - by_state @ state - by_input @ held
    return Linearised(start, state, by_corrected, by_state, by_input, force)


def _derivatives(model: Model, corrected: Array, inputs: Array, tick_s: float) -> list[Array]:
    """Return outputs, rates and accelerations; inputs are held, and lags have settled."""
    nothing, command = (0.0,) * model.correction_size, tuple(inputs.tolist())
    first = tuple(corrected.tolist())
    state = (*first, *model.initial()[len(first) :])
    if len(state) > len(first):
        for _ in range(SETTLING):
            state = (*first, *model.tick(state, command, nothing)[len(first) :])
    seen = []
    for _ in range(3):
        seen.append(np.array(model.measured(state)))
        state = model.tick(state, command, nothing)
    bent = (seen[2] - 2.0 * seen[1] + seen[0]) / tick_s**2
    return [seen[0], (seen[1] - seen[0]) / tick_s - 0.5 * tick_s * bent, bent]


def start_values(structure: Structure, model: Linearised) -> dict[str, float]:
    """Return the parameters with which a structure is the codec's model, as far as it can be."""
    order, outputs = structure.order, len(structure.equations)
    if isinstance(structure, PitchStructure):
        angle = model.state[0]
        pull = -model.by_state[0, 0]
        rest = model.force[0] + model.by_state[0, 0] * angle
        known = {
            "a_w": -model.by_state[0, 1],
            COSINE: pull * np.cos(angle) - rest * np.sin(angle),
            SINE: pull * np.sin(angle) + rest * np.cos(angle),
            "k_v": model.by_input[0, 0],
        }
        known["a_th"] = np.hypot(known[COSINE], known[SINE])
        return {name: float(known[name]) for name in names_of(structure)}
    found = {}
    for row, equation in enumerate(structure.equations):
        for term in equation.terms:
            if term.signal < outputs:
                value = model.by_state[row, term.signal * order + term.derivative]
            elif term.derivative:
                value = 0.0
            elif term.signal < outputs + model.by_input.shape[1]:
                value = model.by_input[row, term.signal - outputs]
            else:
                value = model.force[row]
            found[term.name] = float(term.sign * value)
    return found
