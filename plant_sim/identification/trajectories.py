"""Simulations of all segments of a record, under several sets of parameters at once.

A step of one set takes numpy's calls longer than its arithmetic, so that a few sets side by side take
little more time than one. Each set's numbers are those that it has alone, but for rounding.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from scipy.linalg import expm

from plant_sim.identification.filters import Array, lagged
from plant_sim.identification.segments import Segments
from plant_sim.identification.structures import LinearStructure, PitchStructure, Structure

NUDGE = 1e-4
"""by which initial states are moved for their derivatives"""
WILD = 1e3
"""times the usual motion: where a wild guess of the parameters is cut off"""
SIDE_BY_SIDE = 4000
"""initial states that are simulated at once: beyond it, arithmetic takes most of the time"""


class Candidate(NamedTuple):
    """Parameters that are simulated, and the segments that they are compared with."""

    values: Mapping[str, float]
    lag_s: float
    segments: Segments
    """with the inputs of all candidates; the outputs may be its own"""


class _Given(NamedTuple):
    """The start of a simulation of all segments."""

    candidates: Sequence[Candidate]
    acting: list[Array]
    """of each candidate, (samples, segments, inputs): the lagging inputs"""
    starts: Array
    """(candidates, copies, segments, states)"""


def simulation_residuals(structure: Structure, candidates: Sequence[Candidate]) -> list[Array]:
    """Return of each (samples, segments, outputs): simulated minus recorded.

    The simulations begin at the states that fit the outputs best.
    """
    count = candidates[0].segments.outputs.shape[1]
    states = structure.order * len(structure.equations)
    at_once = max(1, SIDE_BY_SIDE // (count * (states + 1)))
    found: list[Array] = []
    for first in range(0, len(candidates), at_once):
        found += _residuals(structure, candidates[first : first + at_once])
    return found


def _residuals(structure: Structure, candidates: Sequence[Candidate]) -> list[Array]:
    segments = candidates[0].segments
    lagging = {lag_s: _acting(segments, lag_s) for lag_s in {one.lag_s for one in candidates}}
    acting = [lagging[one.lag_s] for one in candidates]
    if not isinstance(structure, PitchStructure):
        size = structure.order * len(structure.equations)
        rest = np.zeros((len(candidates), segments.outputs.shape[1], size))
        return _from_best_states(structure, candidates, acting, rest, 1.0)[0]
    # The sine bends what a change of the initial state does: a second step from the better one.
    states = np.stack([_start(one.segments) for one in candidates])
    _, moved = _from_best_states(structure, candidates, acting, states, NUDGE)
    return _from_best_states(structure, candidates, acting, states - moved, NUDGE)[0]


def _from_best_states(
    structure: Structure,
    candidates: Sequence[Candidate],
    acting: list[Array],
    states: Array,
    nudge: float,
) -> tuple[list[Array], Array]:
    """Return the residuals from initial states that fit best to first order, and their change."""
    size = states.shape[2]
    offsets = nudge * np.vstack([np.zeros(size), np.eye(size)])
    given = _Given(candidates, acting, states[:, None] + offsets[None, :, None])
    with np.errstate(all="ignore"):
        if isinstance(structure, PitchStructure):
            simulated = _pitch(structure, given)
        else:
            simulated = _linear(structure, given)
    left, changes = [], []
    for one, found in zip(candidates, simulated, strict=True):
        segments = one.segments
        wild = WILD * segments.scale
        found = np.clip(np.nan_to_num(found, nan=0.0), -wild, wild)
        errors = found[:, 0] - segments.outputs
        slopes = (found[:, 1:] - found[:, :1]) / nudge
        # The best initial state of each segment: least squares over its samples and outputs.
        weights = 1.0 / segments.scale**2
        normal = np.einsum("tisp,tjsp,p->sij", slopes, slopes, weights)
        pulled = np.einsum("tisp,tsp,p->si", slopes, errors, weights)
        ridge = 1e-12 * np.trace(normal, axis1=1, axis2=2)[:, None, None] * np.eye(size)
        moved = np.linalg.solve(normal + ridge + 1e-300 * np.eye(size), pulled[:, :, None])[:, :, 0]
        left.append(np.asarray(errors - np.einsum("tisp,si->tsp", slopes, moved)))
        changes.append(moved)
    return left, np.stack(changes)


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


def _linear(structure: LinearStructure, given: _Given) -> Array:
    """Return the simulated outputs: (candidates, samples, copies, segments, outputs)."""
    transitions, seen, drives = [], [], []
    for one, acting in zip(given.candidates, given.acting, strict=True):
        transition, output, drive = _discretised(structure, one, acting)
        transitions.append(transition)
        seen.append(output)
        drives.append(drive)
    sets, copies, count, size = given.starts.shape
    transition, output, drive = np.stack(transitions), np.stack(seen), np.stack(drives, axis=1)
    samples = len(drive)
    found = np.empty((sets, samples, copies * count, output.shape[2]))
    driven = np.broadcast_to(drive[:, :, None], (samples, sets, copies, count, size))
    state = given.starts.reshape(sets, copies * count, size)
    for index in range(samples):
        found[:, index] = state @ output
        state = state @ transition + driven[index].reshape(sets, copies * count, size)
    return found.reshape(sets, samples, copies, count, -1)


def _discretised(
    structure: LinearStructure, candidate: Candidate, acting: Array
) -> tuple[Array, Array, Array]:
    """Return, for states as rows, the transition, the outputs' matrix and what drives each sample."""
    segments, lag_s = candidate.segments, candidate.lag_s
    model = structure.state_space(candidate.values)
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
    return step[:, :size].T, model.C.T, drive[:, :, :, 0] + step[:, -1]


def _pitch(structure: PitchStructure, given: _Given) -> Array:
    """Return the simulated angles: (candidates, samples, copies, segments, 1).

    They are those of (11), by classical Runge-Kutta.
    """
    segments = given.candidates[0].segments
    h = segments.step_s
    lags = [one.lag_s for one in given.candidates]
    halves = [math.exp(-0.5 * h / lag_s) if lag_s > 0.0 else 0.0 for lag_s in lags]
    constants = np.array([structure.constants(one.values) for one in given.candidates])
    gain = constants[:, 2, None, None]
    half = np.array(halves)[:, None, None]
    # (samples, candidates, 1, segments)
    held = segments.inputs[:, None, None, :, 0]
    acting = np.stack([one[:, :, 0] for one in given.acting], axis=1)[:, :, None]
    start = gain * acting
    middle = gain * (held + (acting - held) * half)
    end = gain * (held + (acting - held) * half * half)
    theta, omega = given.starts[..., 0].copy(), given.starts[..., 1].copy()
    # Of the same shape: numpy takes several times as long where it has to repeat numbers.
    damping, stiffness, _, equilibrium = (
        np.repeat(one, theta[0].size).reshape(theta.shape) for one in constants.T
    )
    angles = np.empty((len(theta), len(held), *theta.shape[1:], 1))
    places = angles[..., 0].swapaxes(0, 1)
    for index in range(len(held)):
        places[index] = theta
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
