"""The regression (6): a structure's equations between filtered signals, solved by (9), (10)."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from plant_sim.identification.errors import IdentificationError
from plant_sim.identification.estimator import (
    BLOCKS_MAX,
    Estimate,
    Moments,
    estimate,
    joined,
    moments_of,
)
from plant_sim.identification.filters import Array, SignalFilter, low_pass
from plant_sim.identification.record import Record
from plant_sim.identification.structures import Equation, Structure, functions_of

MEMORY = 3.0
"""of the filters, over their bandwidth"""
PIECE = 200_000
"""samples that are filtered at once"""


@dataclass(frozen=True, slots=True)
class Filters:
    """Constants of the algorithm; the defaults are the paper's."""

    bandwidth_rad_s: float = 1.0
    """w_f"""
    damping: float = 0.7
    """rho of the filters"""
    forgetting_per_s: float = 0.01
    """alpha"""
    gain: float | None = 1e3
    """diagonal of Gamma(0); None: large, by the size of each regressor"""
    lag_s: float = 0.0
    """T_m, through which every input acts"""
    rests: bool = True
    """the record begins at rest with its inputs at 0; otherwise its beginning is estimated too"""


@dataclass(frozen=True, slots=True, eq=False)
class Regression:
    """The result for a whole record."""

    structure: Structure
    filters: Filters
    estimates: tuple[Estimate, ...]
    """of each equation"""
    times_s: Array
    """of the history's rows"""
    filtered_input: Array
    """mu_f of Fig. 3, of the first input, at those times"""

    @property
    def values(self) -> dict[str, float]:
        return self._named([one.values for one in self.estimates])

    def values_at(self, row: int) -> dict[str, float]:
        """Return the parameters of a row of the history."""
        return self._named([one.history[row] for one in self.estimates])

    def _named(self, columns: list[Array]) -> dict[str, float]:
        return {
            term.name: float(value)
            for equation, values in zip(self.structure.equations, columns, strict=True)
            for term, value in zip(equation.terms, values, strict=False)
        }

    @property
    def covariance(self) -> Array:
        """Return the parameters' covariance; those of different equations are taken apart."""
        pairs = zip(self.structure.equations, self.estimates, strict=True)
        counted = [(len(equation.terms), one.covariance) for equation, one in pairs]
        return np.asarray(block_diag(*[whole[:count, :count] for count, whole in counted]))

    @property
    def condition(self) -> float:
        """Return the excitation of the equation that has least."""
        return min(one.condition for one in self.estimates)


def regress(
    record: Record, structure: Structure, filters: Filters, *, blocks: int = BLOCKS_MAX
) -> Regression:
    """Filter a record and estimate the parameters of each equation."""
    if filters.lag_s < 0.0:
        raise IdentificationError(f"the motor lag is {filters.lag_s} s; it must be at least 0")
    require_bandwidth(filters.bandwidth_rad_s, record.step_s)
    polynomial = low_pass(structure.order, filters.bandwidth_rad_s, filters.damping)
    block = math.ceil(len(record) / blocks)
    piece = max(1, PIECE // block) * block
    sums: list[list[Moments]] = [[] for _ in structure.equations]
    inputs = []
    for columns, modes, first in _filtered(record, structure, filters, polynomial, piece):
        inputs.append(first[block - 1 :: block])
        for equation, into in zip(structure.equations, sums, strict=True):
            regressors, target = _rows(equation, columns, modes)
            into.append(moments_of(regressors, target, record.step_s, block))
    found = tuple(
        estimate(
            joined(pieces),
            forgetting_per_s=filters.forgetting_per_s,
            gain=filters.gain,
            memory_s=MEMORY / filters.bandwidth_rad_s,
            shown=len(equation.terms),
            constants=constants_of(structure, equation, structure.acting(record.inputs[:1]).shape[1]),
        )
        for equation, pieces in zip(structure.equations, sums, strict=True)
    )
    rows = len(found[0].history)
    ends = np.minimum(np.arange(1, rows + 1) * block, len(record)) - 1
    shown = np.concatenate(inputs)
    shown = np.concatenate((shown, shown[-1:]))[:rows]
    return Regression(structure, filters, found, ends * record.step_s, shown)


def require_bandwidth(bandwidth_rad_s: float, step_s: float) -> None:
    """Raise IdentificationError for a filter that there is not, or not at these samples."""
    if not bandwidth_rad_s > 0.0:
        raise IdentificationError(f"filter bandwidth {bandwidth_rad_s:g} rad/s: give one above 0")
    if bandwidth_rad_s * step_s > 1.0:
        raise IdentificationError(
            f"a filter of {bandwidth_rad_s:g} rad/s needs samples closer than {step_s:g} s; it may "
            f"have {1.0 / step_s:.3g} rad/s at most"
        )


Columns = Mapping[tuple[int, int], Array]


def constants_of(structure: Structure, equation: Equation, inputs: int) -> list[int]:
    """Return which of an equation's regressors are the constant 1."""
    signal = functions_of(structure) + inputs
    return [place for place, term in enumerate(equation.terms) if term.signal == signal]


def _rows(equation: Equation, columns: Columns, modes: list[Array]) -> tuple[Array, Array]:
    terms = [term.sign * columns[term.signal, term.derivative] for term in equation.terms]
    return np.stack((*terms, *modes), axis=1), columns[equation.signal, equation.derivative]


def _filtered(
    record: Record, structure: Structure, filters: Filters, polynomial: tuple[float, ...], piece: int
) -> Iterator[tuple[Columns, list[Array], Array]]:
    """Yield the filtered signals that the equations name, what the beginning adds, and input 0."""
    start = structure.signals(record.outputs[:1])[0]
    acting = structure.acting(record.inputs[:1])[0]
    before = np.zeros_like(acting) if filters.rests else acting
    steps = (polynomial, record.step_s)
    lines = [SignalFilter(*steps, float(value)) for value in start]
    held = [SignalFilter(*steps, float(value), True, filters.lag_s) for value in before]
    needed = {(term.signal, term.derivative) for one in structure.equations for term in one.terms}
    needed |= {(one.signal, one.derivative) for one in structure.equations}
    needed.add((len(lines), 0))
    for first in range(0, len(record), piece):
        cut = slice(first, first + piece)
        signals = structure.signals(record.outputs[cut])
        inputs = structure.acting(record.inputs[cut])
        columns = {}
        for signal, derivative in needed:
            if signal < len(lines):
                values = lines[signal].take(signals[:, signal], derivative)
            elif signal < len(lines) + len(held):
                index = signal - len(lines)
                values = held[index].take(inputs[:, index], derivative)
            elif signal == len(lines) + len(held):
                values = np.ones(len(signals))
            columns[signal, derivative] = values
        modes = [] if filters.rests else [*lines[0].modes(first, len(signals)).T]
        mu = columns.get((len(lines), 0), np.zeros(len(signals)))
        yield columns, modes, mu
