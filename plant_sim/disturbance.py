"""Torque disturbances: torques on the plant beside its motors.

A torque here is already divided by the inertia: an angular acceleration in rad/s^2, held for one
plant step. Every disturbance is a pure function of the step index, so steps may be asked for again.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final, Protocol, TypeAlias

if TYPE_CHECKING:
    # Loaded where torques are drawn: a plant without them flies on bare Python.
    import numpy as np

GRAMMAR: Final = (
    "comma-separated q=DENSITY (rad^2/s^3, at most once) and step=TORQUE@START[..END] "
    "(rad/s^2, seconds), for example q=2e-3,step=0.5@10..12; where a plant is disturbed in several "
    "places, q is that of each of them and step is at the first, or one value for each: q=1e-3:2e-6"
)

Torques: TypeAlias = "np.ndarray[tuple[int], np.dtype[np.float64]]"
Pushes: TypeAlias = "np.ndarray[tuple[int, int], np.dtype[np.float64]]"

# Numbers drawn at once: large enough that numpy's cost per call vanishes, small enough (128 kB as
# Python floats) that the length of a run costs no memory.
BLOCK_STEPS: Final = 4096

# A time within this share of a step after a step's start counts as that start, so that 12.5 s is
# step 1250 at 0.01 s whatever the rounding of the division.
_STEP_TOLERANCE: Final = 1e-6


class Disturbance(Protocol):
    """A torque for every plant step."""

    def torque(self, step_index: int) -> float:
        """Angular acceleration (rad/s^2) held over step `step_index` (0 is the first)."""
        ...


class PlannedDisturbance(ABC):
    """A disturbance whose torques can be had in advance, as studies ask for them.

    They are drawn in blocks of steps, of which only one is ever kept.
    """

    _block_index: int | None = None
    _block: Sequence[float] = ()

    def torque(self, step_index: int) -> float:
        """Return the angular acceleration (rad/s^2) held over a step."""
        block_index, offset = divmod(step_index, BLOCK_STEPS)
        if block_index != self._block_index:
            if step_index < 0:
                raise ValueError(f"step_index is {step_index}; it must be at least 0")
            self._block, self._block_index = self.draw(block_index).tolist(), block_index
        return self._block[offset]

    def torques(self, steps: int) -> Torques:
        """Return those of steps `0 ... steps - 1` at once, to the last bit those of `torque`."""
        import numpy as np

        blocks = range(-(-steps // BLOCK_STEPS))
        return np.concatenate([np.empty(0), *(self.draw(index) for index in blocks)])[:steps]

    @abstractmethod
    def draw(self, block_index: int) -> Torques:
        """Return the torques of a block."""


def pushes_of(disturbances: Sequence[Disturbance | None], steps: int) -> Pushes:
    """Return the disturbance of the first steps, a column per place; one row without any."""
    import numpy as np

    planned = [one.torques(steps) for one in disturbances if isinstance(one, PlannedDisturbance)]
    return np.column_stack(planned) if planned else np.zeros((1, len(disturbances)))


class WhiteTorque(PlannedDisturbance):
    """White torque: independent Gaussian values, one per step, of variance density / step.

    Divided this way the rate wanders equally far whatever the step: its variance grows by
    `spectral_density_rad2_s3` per second (two-sided density). Equal seeds give equal torques with
    one version of numpy; the block number enters the seed. Each `place` has values of its own.
    """

    def __init__(
        self, spectral_density_rad2_s3: float, step_s: float, seed: int, place: int = 0
    ) -> None:
        """Take a density of at least 0, a step above 0 and a seed of at least 0."""
        if not (math.isfinite(spectral_density_rad2_s3) and spectral_density_rad2_s3 >= 0.0):
            raise ValueError(
                f"spectral_density_rad2_s3 is {spectral_density_rad2_s3}; "
                "it must be finite and at least 0"
            )
        _require_step(step_s)
        if seed < 0:
            raise ValueError(f"seed is {seed}; it must be at least 0")
        self._deviation = math.sqrt(spectral_density_rad2_s3 / step_s)
        self._seed = seed
        self._key = (place,) if place else ()

    def draw(self, block_index: int) -> Torques:
        from numpy.random import PCG64, Generator, SeedSequence

        sequence = SeedSequence(self._seed, spawn_key=(block_index, *self._key))
        return Generator(PCG64(sequence)).standard_normal(BLOCK_STEPS) * self._deviation


class StepTorque(PlannedDisturbance):
    """A constant torque from `start_s` until `end_s`, or for ever: a push, or a hung weight.

    It acts on whole steps: on those that begin in `start_s <= t < end_s`.
    """

    def __init__(
        self, start_s: float, torque_rad_s2: float, step_s: float, end_s: float | None = None
    ) -> None:
        """Take a start of at least 0 s, an end after it, and a finite torque."""
        _require_step(step_s)
        if not (math.isfinite(start_s) and start_s >= 0.0):
            raise ValueError(f"start_s is {start_s}; it must be finite and at least 0")
        if not math.isfinite(torque_rad_s2):
            raise ValueError(f"torque_rad_s2 is {torque_rad_s2}; it must be finite")
        if end_s is not None and not (math.isfinite(end_s) and end_s > start_s):
            raise ValueError(f"end_s is {end_s}; it must be finite and above start_s = {start_s}")
        self._torque_rad_s2 = torque_rad_s2
        self._start_step = math.ceil(start_s / step_s - _STEP_TOLERANCE)
        self._end_step = math.inf if end_s is None else end_s / step_s - _STEP_TOLERANCE

    def draw(self, block_index: int) -> Torques:
        import numpy as np

        steps = np.arange(block_index * BLOCK_STEPS, (block_index + 1) * BLOCK_STEPS)
        acts = (steps >= self._start_step) & (steps < self._end_step)
        return np.where(acts, float(self._torque_rad_s2), 0.0)


class Sum(PlannedDisturbance):
    """Several disturbances at once."""

    def __init__(self, *parts: PlannedDisturbance) -> None:
        """Add up `parts`; of none at all the sum is 0."""
        self._parts = parts

    def draw(self, block_index: int) -> Torques:
        import numpy as np

        total = np.zeros(BLOCK_STEPS)
        for part in self._parts:
            total += part.draw(block_index)
        return total


def parse_disturbance(text: str, step_s: float, seed: int, place: int = 0) -> PlannedDisturbance:
    """Build the disturbance a command line names, as `GRAMMAR` says, that of one place of the plant.

    Raises ValueError that names the piece that is wrong and repeats the grammar.
    """
    _require_step(step_s)
    parts: list[PlannedDisturbance] = []
    has_density = False
    for piece in text.split(","):
        kind, _, value = piece.strip().partition("=")
        try:
            if kind == "q":
                if has_density:
                    raise ValueError("q is given twice")
                has_density = True
                density = _of_place(value, "q", place, for_all=True)
                parts.append(WhiteTorque(density, step_s, seed, place))
            elif kind == "step":
                parts.append(_parse_step(value, step_s, place))
            else:
                raise ValueError(f"unknown kind '{kind}'")
        except ValueError as error:
            raise ValueError(
                f"disturbance piece '{piece.strip()}': {error}; expected {GRAMMAR}"
            ) from None
    return Sum(*parts)


def is_random(text: str) -> bool:
    """Return whether another seed gives another disturbance; ValueError as above."""
    places = range(1 + text.count(":") if text else 0)
    seeds = [[parse_disturbance(text, 1.0, seed, at).torque(0) for at in places] for seed in (0, 1)]
    return seeds[0] != seeds[1]


def require_places(text: str, places: int) -> None:
    """Raise ValueError where a disturbance has more values than the plant has places for them."""
    for piece in text.split(","):
        given = piece.count(":") + 1
        if given > places:
            raise ValueError(
                f"disturbance piece '{piece.strip()}' has {given} values, and this plant is disturbed "
                f"in {places} place(s)"
            )


def _of_place(values: str, name: str, place: int, *, for_all: bool = False) -> float:
    """Return the value of one place, 0 where it has none; every value must be a number."""
    given = [_number(value, name) for value in values.split(":")]
    if for_all and len(given) == 1:
        return given[0]
    return given[place] if place < len(given) else 0.0


def _parse_step(value: str, step_s: float, place: int) -> StepTorque:
    torque_text, at, times = value.partition("@")
    if not at:
        raise ValueError("a step needs '@START'")
    start_text, dots, end_text = times.partition("..")
    return StepTorque(
        start_s=_number(start_text, "START"),
        torque_rad_s2=_of_place(torque_text, "TORQUE", place),
        step_s=step_s,
        end_s=_number(end_text, "END") if dots else None,
    )


def _number(text: str, name: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise ValueError(f"{name} is '{text}', not a number") from None


def _require_step(step_s: float) -> None:
    if not (math.isfinite(step_s) and step_s > 0.0):
        raise ValueError(f"step_s is {step_s}; it must be finite and above 0")
