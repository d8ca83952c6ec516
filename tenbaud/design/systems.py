"""Plants from python-control and scipy, read into matrices and names.

They are known by their attributes, so neither library is imported here: a state space has A, B, C, D
and dt, a nonlinear system dynamics, output and the numbers of its signals. A nonlinear one is
linearised at an operating point, for the codec.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from plant_sim.zero_order_hold import differences
from tenbaud.bounds.linear import Matrix
from tenbaud.config.load import ConfigError

STEP = 2.0**-14
"""by which states and inputs are moved for the derivatives, times their size where that is above 1"""
LEAST = 1e-9
"""share of the largest derivative below which one is none"""
REST_MAX = 1e-6
"""fastest change of a state at rest, and largest error of an output, per unit of size"""
LATER_S = (0.37, 11.3)
"""times at which an autonomous system behaves as at time 0"""
LABEL = re.compile(r"(.*?)\s*(?:\[([^\]]*)\]|\(([^)]*)\)|,\s*(.*))?")
NUMBERED = re.compile(r"[A-Za-z]+\[\d+\]")
"""A name that python-control gives to a signal without one."""


class StateSpace(Protocol):
    """`control.StateSpace` or `scipy.signal.StateSpace`."""

    A: Any
    B: Any
    C: Any
    D: Any
    dt: Any


class NonlinearSystem(Protocol):
    """`control.NonlinearIOSystem`."""

    nstates: Any
    ninputs: Any
    noutputs: Any
    dt: Any

    def dynamics(self, t: Any, x: Any, u: Any) -> Any:
        """Return dx/dt, or the next state of a discrete system."""
        ...

    def output(self, t: Any, x: Any, u: Any) -> Any:
        """Return y."""
        ...


System: TypeAlias = StateSpace | NonlinearSystem
Point: TypeAlias = tuple[ArrayLike, ArrayLike]
"""States and inputs, x0 and u0."""


class Names(NamedTuple):
    """The names of a system's signals; none if it has no names."""

    state: tuple[str, ...]
    input: tuple[str, ...]
    output: tuple[str, ...]

    def of(self, what: str, place: int) -> str:
        """Return the name of a signal in an error."""
        names: tuple[str, ...] = getattr(self, what)
        return f"{what} {names[place] if names else place + 1}"


@dataclass(frozen=True, slots=True)
class Matrices:
    """A system as the codec predicts it: dx/dt = A (x - x0) + B (u - u0), y = C x."""

    A: Matrix
    B: Matrix
    C: Matrix
    dt: float
    """step of a discrete system, whose next state is that right side; 0: it is continuous"""
    names: Names
    x0: Matrix
    u0: Matrix
    linear: bool
    """whether this is all there is"""


def is_system(given: object) -> bool:
    """Return whether an object is a system of one of these libraries."""
    kinds = (("A", "B", "C", "D", "dt"), ("dynamics", "output", "nstates"), ("to_ss",))
    return any(all(hasattr(given, name) for name in names) for names in kinds)


def state_space(system: Any) -> Any:
    """Return a system that has states; a transfer function becomes one."""
    return system.to_ss() if not hasattr(system, "A") and hasattr(system, "to_ss") else system


def matrices(system: Any, point: Any = None) -> Matrices:
    """Return the matrices of a system, at the operating point (x0, u0) if it is not linear.

    Raises ConfigError, with signal and number, for a system that cannot be flown.
    """
    system = state_space(system)
    dt = _period_s(system)
    if hasattr(system, "A"):
        if point is not None:
            raise ConfigError(
                "operating_point is for a system that is not linear; this one has matrices"
            )
        A, B, C, D = (np.atleast_2d(np.asarray(getattr(system, one), dtype=float)) for one in "ABCD")
        names = _names(system, (len(A), B.shape[1], len(C)))
        x, u = np.zeros(len(A)), np.zeros(B.shape[1])
    else:
        sizes = tuple(getattr(system, f"n{what}s") or 0 for what in Names._fields)
        for what, size in zip(Names._fields, sizes, strict=True):
            if not size:
                raise ConfigError(f"the system has no {what}s, or does not say how many")
        names = _names(system, sizes)
        x, u = _point(point, sizes)
        A, B, C, D = _linearised(system, x, u, names, discrete=dt > 0.0)
    if len(A) == 0:
        raise ConfigError("the system has no states, so there is nothing to estimate")
    for row, column in np.argwhere(D)[:1]:
        raise ConfigError(
            f"D is not zero: {names.of('output', row)} has {D[row, column]:g} of "
            f"{names.of('input', column)} at once, and an output must follow from the states alone: "
            "give the input a lag, or take its share out of the output"
        )
    return Matrices(A, B, C, dt, names, x, u, hasattr(system, "A"))


def _period_s(system: Any) -> float:
    """Return dt of a discrete system, 0 for a continuous one."""
    dt = system.dt
    if dt is True:
        raise ConfigError("the system is discrete and its dt is not given; give it in seconds")
    return 0.0 if dt is None else float(dt)


def _names(system: Any, sizes: Sequence[int]) -> Names:
    found = []
    for what, size in zip(Names._fields, sizes, strict=True):
        labels = [str(one) for one in getattr(system, f"{what}_labels", None) or ()]
        if labels and len(labels) != size:
            raise ConfigError(
                f"the system has {size} {what}(s) and names {len(labels)}: {', '.join(labels)}; "
                "python-control keeps a name that is given twice only once"
            )
        unnamed = all(NUMBERED.fullmatch(label) for label in labels)
        found.append(() if unnamed else tuple(labels))
    return Names(*found)


def name_and_unit(label: str) -> tuple[str, str]:
    """Return the name of a signal and its unit: "Pitch rate [rad/s]", "(rad/s)" or ", rad/s"."""
    match = None if NUMBERED.fullmatch(label) else LABEL.fullmatch(label.strip())
    name, *units = match.groups() if match else (label,)
    return re.sub(r"[\s\-\[\]]+", "_", name.lower()).strip("_"), next(filter(None, units), "")


def _point(point: Any, sizes: Sequence[int]) -> tuple[Matrix, Matrix]:
    """Return x0 and u0, from a pair or what `control.find_operating_point` returns; zeros without."""
    if point is None:
        return np.zeros(sizes[0]), np.zeros(sizes[1])
    pair = (point.states, point.inputs) if hasattr(point, "states") else point
    try:
        x, u = (np.atleast_1d(np.asarray(one, dtype=float)) for one in pair)
    except (TypeError, ValueError) as error:
        raise ConfigError("operating_point must be a pair: the states, and the inputs") from error
    for what, one, size in (("state", x, sizes[0]), ("input", u, sizes[1])):
        if one.shape != (size,) or not np.isfinite(one).all():
            raise ConfigError(
                f"operating_point has the {what}s {one.tolist()}; {size} finite numbers are needed"
            )
    return x, u


def _linearised(
    system: Any, x: Matrix, u: Matrix, names: Names, *, discrete: bool
) -> tuple[Matrix, Matrix, Matrix, Matrix]:
    """Return A, B, C and D at a point; ConfigError unless it is a rest of an autonomous system."""

    def both(states: Matrix, inputs: Matrix, time_s: float = 0.0) -> Matrix:
        parts = (system.dynamics(time_s, states, inputs), system.output(time_s, states, inputs))
        return np.concatenate([np.atleast_1d(np.asarray(one, dtype=float)) for one in parts])

    size = len(x)
    here = both(x, u)
    beside = (x + 0.1 * (1.0 + abs(x)), u + 0.1 * (1.0 + abs(u)))
    for at in ((x, u), beside):
        for time_s in LATER_S:
            then, first = both(*at, time_s), both(*at)
            for place in np.flatnonzero((then != first) & np.isfinite(first))[:1]:
                what = ("state", place) if place < size else ("output", place - size)
                raise ConfigError(
                    f"the system is not autonomous: {'d/dt of ' * (place < size and not discrete)}"
                    f"{names.of(*what)} is {first[place]:.6g} at 0 s and {then[place]:.6g} at "
                    f"{time_s:g} s for the same states and inputs; the codec's model does not change"
                )
    rest = here[:size] - x if discrete else here[:size]
    for place in np.flatnonzero(~(abs(rest) <= REST_MAX * (1.0 + abs(x))))[:1]:
        raise ConfigError(
            f"the operating point is not an equilibrium: {names.of('state', place)} moves by "
            f"{rest[place]:.6g} {'a step' if discrete else 'a second'} there; "
            "control.find_operating_point finds one"
        )
    slopes = _slopes(both, x, u)
    A, B, C, D = slopes[:size, :size], slopes[:size, size:], slopes[size:, :size], slopes[size:, size:]
    for place, (value, predicted) in enumerate(zip(here[size:], C @ x, strict=True)):
        if not abs(value - predicted) <= REST_MAX * (1.0 + abs(value)):
            raise ConfigError(
                f"{names.of('output', place)} is {value:.6g} at the operating point, and its "
                f"linearisation C x gives {predicted:.6g}: subtract the difference from the output"
            )
    return A, B, C, D


def _slopes(both: Callable[[Matrix, Matrix], Matrix], x: Matrix, u: Matrix) -> Matrix:
    """Return the derivatives of dynamics and outputs, a column for each state and input."""
    size = len(x)
    at = np.concatenate([x, u])
    steps = [STEP * max(1.0, 2.0 ** math.floor(math.log2(abs(value) or 1.0))) for value in at]
    slopes = differences(lambda one: both(one[:size], one[size:]), at, np.array(steps))
    if not np.isfinite(slopes).all():
        raise ConfigError("the system has no finite derivative at the operating point")
    slopes[abs(slopes) < LEAST * max(1.0, float(abs(slopes).max()))] = 0.0
    return np.array([[float(f"{value:.9g}") for value in row] for row in slopes.tolist()])
