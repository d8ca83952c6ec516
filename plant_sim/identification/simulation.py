"""A second estimate: the parameters whose simulation fits the record best.

The record is cut into segments. Each is simulated under the recorded inputs, from the initial state
that fits its outputs best, and the difference to the recorded outputs is minimised by
`scipy.optimize.least_squares`. It shares nothing with the regression (9), (10) but the data and the
structure, so that an error in either method shows as a disagreement.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg import expm
from scipy.optimize import least_squares

from plant_sim.identification.errors import IdentificationError
from plant_sim.identification.filters import Array, lagged
from plant_sim.identification.record import Record
from plant_sim.identification.structures import LinearStructure, PitchStructure, Structure, names_of

SEGMENT_S = 5.0
SEGMENTS_MIN = 4
SAMPLES_MAX = 400_000
"""samples that are simulated; of a longer record, segments all over it"""
DRAWS_MIN = 12
MEMORY_S = 10.0
MEMORY_MAX = 5000
"""seconds and samples before a segment that its lag remembers, at most"""
NUDGE = 1e-4
"""by which initial states are moved for their derivatives"""
WILD = 1e3
"""times the usual motion: where a wild guess of the parameters is cut off"""


@dataclass(frozen=True, slots=True, eq=False)
class SimulationFit:
    """The simulation-error fit."""

    values: dict[str, float]
    covariance: Array
    lag_s: float
    lag_deviation_s: float
    """0 where it was given"""
    residuals: Array
    """root mean square of each output's simulation error"""
    explained: float
    """share of the motion within the segments, beyond their own beginnings, that is simulated"""


@dataclass(frozen=True, slots=True, eq=False)
class Segments:
    """All segments side by side: (samples, segments, signals)."""

    step_s: float
    outputs: Array
    inputs: Array
    before: Array
    """(inputs before each segment, segments, inputs): memory of the lag"""

    @property
    def scale(self) -> Array:
        """Return the usual size of each output's motion within a segment."""
        moved = self.outputs - self.outputs.mean(axis=0)
        return np.asarray(np.maximum(np.sqrt(np.mean(moved**2, axis=(0, 1))), 1e-12))


def cut(record: Record, structure: Structure, segment_s: float, *, rests: bool = False) -> Segments:
    """Return the segments of a record; before one that does not begin at rest its first input held."""
    steps = max(8, round(segment_s / record.step_s))
    count = len(record) // steps
    if count < SEGMENTS_MIN:
        steps, count = len(record) // SEGMENTS_MIN, SEGMENTS_MIN
    chosen = np.arange(count)
    if count * steps > SAMPLES_MAX:
        chosen = np.linspace(0, count - 1, max(SEGMENTS_MIN, SAMPLES_MAX // steps)).astype(int)
    rows = chosen[None, :] * steps + np.arange(steps)[:, None]
    inputs = structure.acting(record.inputs)
    memory = min(len(record), round(MEMORY_S / record.step_s), MEMORY_MAX)
    behind = chosen[None, :] * steps - np.arange(memory, 0, -1)[:, None]
    before = inputs[np.maximum(behind, 0)]
    if rests:
        before[behind < 0] = 0.0
    return Segments(record.step_s, record.outputs[rows], inputs[rows], before)


def every_other(segments: Segments, first: int) -> Segments:
    """Return every other segment."""
    outputs, inputs, before = (
        one[:, first::2] for one in (segments.outputs, segments.inputs, segments.before)
    )
    return Segments(segments.step_s, outputs, inputs, before)


def simulation_residuals(
    structure: Structure, values: Mapping[str, float], lag_s: float, segments: Segments
) -> Array:
    """Return (samples, segments, outputs): simulated minus recorded, from the best initial states."""
    acting = _acting(segments, lag_s)
    if not isinstance(structure, PitchStructure):
        states = np.zeros((segments.outputs.shape[1], structure.order * len(structure.equations)))
        return _from_best_states(structure, values, lag_s, segments, acting, states, 1.0)[0]
    # The sine bends what a change of the initial state does: a second step from the better one.
    states = _start(segments)
    _, moved = _from_best_states(structure, values, lag_s, segments, acting, states, NUDGE)
    return _from_best_states(structure, values, lag_s, segments, acting, states - moved, NUDGE)[0]


def _from_best_states(
    structure: Structure,
    values: Mapping[str, float],
    lag_s: float,
    segments: Segments,
    acting: Array,
    states: Array,
    nudge: float,
) -> tuple[Array, Array]:
    """Return the residuals from initial states that fit best to first order, and their change."""
    size = states.shape[1]
    samples, count, _ = segments.outputs.shape
    starts = np.concatenate([states, *(states + nudge * row for row in np.eye(size))])
    run = _pitch if isinstance(structure, PitchStructure) else _linear
    with np.errstate(all="ignore"):
        found = run(structure, values, _Given(lag_s, segments, acting, starts))  # type: ignore[arg-type]
    wild = WILD * segments.scale
    found = np.clip(np.nan_to_num(found, nan=0.0), -wild, wild).reshape(samples, size + 1, count, -1)
    errors = found[:, 0] - segments.outputs
    slopes = (found[:, 1:] - found[:, :1]) / nudge
    # The best initial state of each segment: least squares over its samples and outputs.
    weights = 1.0 / segments.scale**2
    normal = np.einsum("tisp,tjsp,p->sij", slopes, slopes, weights)
    pulled = np.einsum("tisp,tsp,p->si", slopes, errors, weights)
    ridge = 1e-12 * np.trace(normal, axis1=1, axis2=2)[:, None, None] * np.eye(size)
    moved = np.linalg.solve(normal + ridge + 1e-300 * np.eye(size), pulled[:, :, None])[:, :, 0]
    return np.asarray(errors - np.einsum("tisp,si->tsp", slopes, moved)), moved


class _Given(NamedTuple):
    """The start of a simulation of all segments."""

    lag_s: float
    segments: Segments
    acting: Array
    starts: Array


def _acting(segments: Segments, lag_s: float) -> Array:
    """Return the lagging inputs at every sample of the segments."""
    if lag_s <= 0.0:
        return segments.inputs
    memory = min(len(segments.before), max(1, round(20.0 * lag_s / segments.step_s)))
    both = np.concatenate((segments.before[-memory:], segments.inputs))
    return lagged(both, segments.step_s, lag_s, both[0])[memory:]


def _start(segments: Segments) -> Array:
    """Return angle and rate at each segment's start, by a local cubic."""
    steps = max(5, min(len(segments.outputs), round(0.3 / segments.step_s)))
    times = np.arange(steps) * segments.step_s
    basis = np.linalg.pinv(np.vander(times, 4, increasing=True))
    return np.asarray((basis @ segments.outputs[:steps, :, 0])[:2].T)


def _linear(structure: LinearStructure, values: Mapping[str, float], given: _Given) -> Array:
    lag_s, segments, acting, starts = given
    model = structure.state_space(values)
    size, count = model.B.shape
    # States, lagging inputs, inputs, the constant.
    system = np.zeros((size + 2 * count + 1,) * 2)
    system[:size, :size] = model.A
    system[:size, size : size + count] = model.B
    system[:size, -1] = model.offset
    if lag_s > 0.0:
        inner = slice(size, size + count)
        system[inner, inner] = -np.eye(count) / lag_s
        system[inner, size + count : -1] = np.eye(count) / lag_s
    step = expm(system * segments.step_s)[:size]
    drive = step[:, size : size + count] @ acting[:, :, :, None]
    if lag_s > 0.0:
        drive = drive + step[:, size + count : -1] @ segments.inputs[:, :, :, None]
    drive = drive[:, :, :, 0] + step[:, -1]
    copies = len(starts) // segments.outputs.shape[1]
    state = starts.reshape(copies, -1, size)
    found = np.empty((len(acting), copies, segments.outputs.shape[1], len(model.C)))
    transition, seen = step[:, :size].T, model.C.T
    for index in range(len(acting)):
        found[index] = state @ seen
        state = state @ transition + drive[index]
    return found


def _pitch(structure: PitchStructure, values: Mapping[str, float], given: _Given) -> Array:
    """Return the simulated angles: (11) by classical Runge-Kutta."""
    lag_s, segments, acting, starts = given
    damping, stiffness, gain, equilibrium = structure.constants(values)
    h = segments.step_s
    half = math.exp(-0.5 * h / lag_s) if lag_s > 0.0 else 0.0
    copies = len(starts) // segments.outputs.shape[1]
    held = segments.inputs[:, :, 0]
    start = gain * acting[:, :, 0]
    middle = gain * (held + (acting[:, :, 0] - held) * half)
    end = gain * (held + (acting[:, :, 0] - held) * half * half)
    theta, omega = (column.reshape(copies, -1).copy() for column in starts.T)
    angles = np.empty((len(acting), copies, segments.outputs.shape[1], 1))
    for index in range(len(acting)):
        angles[index, :, :, 0] = theta
        angle = theta - equilibrium
        k1 = start[index] - damping * omega - stiffness * np.sin(angle)
        w2 = omega + 0.5 * h * k1
        k2 = middle[index] - damping * w2 - stiffness * np.sin(angle + 0.5 * h * omega)
        w3 = omega + 0.5 * h * k2
        k3 = middle[index] - damping * w3 - stiffness * np.sin(angle + 0.5 * h * w2)
        w4 = omega + h * k3
        k4 = end[index] - damping * w4 - stiffness * np.sin(angle + h * w3)
        theta = theta + h / 6.0 * (omega + 2.0 * (w2 + w3) + w4)
        omega = omega + h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)
    return angles


def fit(
    segments: Segments,
    structure: Structure,
    start: Mapping[str, float],
    lag_s: float,
    *,
    estimate_lag: bool = False,
) -> SimulationFit:
    """Fit a structure to the segments, beginning at the values `start` and the lag `lag_s`."""
    names = names_of(structure)
    guess = np.array([start[name] for name in names] + [lag_s] * estimate_lag)
    scale = segments.scale

    def residuals(values: Array) -> Array:
        lag = float(abs(values[-1])) if estimate_lag else lag_s
        named = dict(zip(names, values.tolist(), strict=False))
        return np.asarray(simulation_residuals(structure, named, lag, segments) / scale).ravel()

    size = np.maximum(np.abs(guess), 0.05)
    if estimate_lag:
        size[-1] = max(lag_s, segments.step_s)
    if not np.all(np.isfinite(guess)):
        raise IdentificationError("the regression gave no numbers to begin the simulation with")
    solution = least_squares(residuals, guess, x_scale=size, max_nfev=30, loss="linear")
    jacobian: Array = np.asarray(solution.jac, dtype=np.float64)
    covariance = _covariance(jacobian, solution.fun, segments)
    errors = solution.fun.reshape(segments.outputs.shape) * scale
    still = simulation_residuals(structure, dict.fromkeys(names, 0.0), 0.0, segments)
    moved = float(np.mean((still / scale) ** 2))
    values = solution.x.tolist()
    return SimulationFit(
        dict(zip(names, values, strict=False)),
        covariance[: len(names), : len(names)],
        abs(values[-1]) if estimate_lag else lag_s,
        math.sqrt(max(0.0, covariance[-1, -1])) if estimate_lag else 0.0,
        np.sqrt(np.mean(errors**2, axis=(0, 1))),
        1.0 - float(np.mean(solution.fun**2)) / moved if moved else 0.0,
    )


def _covariance(jacobian: Array, errors: Array, segments: Segments) -> Array:
    """Return the parameters' covariance, the errors of each stretch being one draw.

    A stretch is a segment, or a part of one where the segments are too few.
    """
    samples, count, outputs = segments.outputs.shape
    size = jacobian.shape[1]
    parts = min(samples, math.ceil(max(DRAWS_MIN, 3 * size) / count))
    edges = np.arange(parts) * samples // parts
    bread = np.linalg.pinv(jacobian.T @ jacobian)
    scores = (jacobian * errors[:, None]).reshape(samples, count, outputs, size).sum(axis=2)
    draws = np.add.reduceat(scores, edges, axis=0).reshape(-1, size)
    return np.asarray(bread @ (draws.T @ draws) @ bread * (len(draws) / max(1, len(draws) - size)))
