"""The statements of a flight's symbols, and their likelihood for a structure's parameters."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from plant_sim.identification.filters import Array, lagged
from plant_sim.identification.structures import LinearStructure, PitchStructure, Structure, names_of
from plant_sim.zero_order_hold import van_loan

STEP_MAX = 0.3
"""of a Runge-Kutta step, over the time constant of the fastest motion"""
LOG_DENSITY_MIN, LOG_DENSITY_MAX = -60.0, 40.0
LOG_WRONG_MIN, LOG_WRONG_MAX = -15.0, -0.1


@dataclass(frozen=True, slots=True, eq=False)
class Symbols:
    """Symbols as statements about outputs and their rates, and the commands meanwhile.

    The states are each output and its derivatives below the structure's order, output by output.
    """

    period_s: float
    """of a sample"""
    firsts: Array
    """of each sample its first statement, and the number of all"""
    combinations: Array
    """a row for each statement: c of the combination c' x of states"""
    lows: Array
    highs: Array
    """c' x as it is read lies between them"""
    spreads: Array
    """variance of the reading error of c' x"""
    inputs: Array
    """a row for each tick"""
    start: Array
    start_deviations: Array
    """of the state before the first sample, as both ends assume it"""
    estimates: Array
    """the codec's own estimate of the state before each sample"""
    arrived: int
    """symbols of two values; all those of a word may make one statement"""

    def __len__(self) -> int:
        return len(self.firsts) - 1

    @property
    def tick_s(self) -> float:
        return self.period_s * len(self) / len(self.inputs)


def averaged(inputs: Array, tick_s: float, lag_s: float) -> Array:
    """Return the mean of each lagging input over each tick; before, the first one was held."""
    if lag_s <= 0.0:
        return inputs
    start = lagged(inputs, tick_s, lag_s, inputs[0])
    share = lag_s / tick_s * (1.0 - math.exp(-tick_s / lag_s))
    return np.asarray(inputs + (start - inputs) * share)


@dataclass(frozen=True, eq=False)
class Likelihood:
    """The log-likelihood of each sample's symbols.

    A point is the structure's parameters, then logarithms: of the density q of the white disturbance of
    each equation, and of the share of symbols that say nothing, as flipped ones do. `function` is
    `follow`, compiled.
    """

    symbols: Symbols
    structure: Structure
    lag_s: float
    steps: int
    """in a sample"""
    function: Callable[..., None]
    drives: Array = field(init=False)

    def __post_init__(self) -> None:
        symbols = self.symbols
        acting = averaged(self.structure.acting(symbols.inputs), symbols.tick_s, self.lag_s)
        rows = acting.reshape(len(symbols) * self.steps, -1, acting.shape[1]).mean(axis=1)
        object.__setattr__(self, "drives", rows)

    def __call__(self, point: Array) -> tuple[Array, Array]:
        """Return the log-likelihood of each sample, and the mean state after its symbols."""
        symbols, structure = self.symbols, self.structure
        names = names_of(structure)
        values = dict(zip(names, point[: len(names)].tolist(), strict=True))
        A, B, force, sine = matrices(structure, values)
        size, step_s = len(A), symbols.period_s / self.steps
        noise = np.zeros((size, size))
        last = np.arange(structure.order - 1, size, structure.order)
        noise[last, last] = np.exp(np.clip(point[len(names) : -1], LOG_DENSITY_MIN, LOG_DENSITY_MAX))
        wrong = math.exp(min(max(float(point[-1]), LOG_WRONG_MIN), LOG_WRONG_MAX))
        logs, means = np.empty(len(symbols)), np.empty((len(symbols), size))
        given = (symbols.firsts, symbols.combinations, symbols.lows, symbols.highs, symbols.spreads)
        start = (symbols.start.copy(), np.diag(symbols.start_deviations**2))
        drive = np.ascontiguousarray(self.drives @ B.T + force)
        _, added = van_loan(A, noise, step_s)
        work = np.zeros((6, size, size))
        self.function(A, sine, drive, added, step_s, *given, wrong, *start, work, logs, means)
        return logs, means


def matrices(structure: Structure, values: Mapping[str, float]) -> tuple[Array, Array, Array, Array]:
    """Return A, B, the constant force, and what multiplies the sine and cosine of the first state."""
    if isinstance(structure, PitchStructure):
        damping, stiffness, gain, angle = structure.constants(values)
        sine = np.array([stiffness * math.cos(angle), stiffness * math.sin(angle)])
        return np.array([[0.0, 1.0], [0.0, -damping]]), np.array([[0.0], [gain]]), np.zeros(2), sine
    assert isinstance(structure, LinearStructure)
    space = structure.state_space(values)
    return space.A, space.B, space.offset, np.zeros(2)


def likelihood(
    symbols: Symbols,
    structure: Structure,
    lag_s: float,
    values: Mapping[str, float],
    function: Callable[..., None],
) -> Likelihood:
    """Return the likelihood, its steps short for the motion that `values` mean."""
    A, _, _, sine = matrices(structure, values)
    fastest = max(float(np.abs(np.linalg.eigvals(A)).max()), math.sqrt(math.hypot(*sine)))
    ticks = len(symbols.inputs) // len(symbols)
    least = max(2.0, symbols.period_s * fastest / STEP_MAX)
    whole = [count for count in range(1, ticks + 1) if ticks % count == 0 and count >= least]
    return Likelihood(symbols, structure, lag_s, whole[0] if whole else ticks, function)
