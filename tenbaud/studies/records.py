"""Variants of a recorded flight on which constants are fitted.

A record is one sample of the disturbance: constants fitted to it alone overfit and fail on the next. So
it is flown at several sizes, and with random pushes: heavy-tailed noise (Student's t, two degrees of
freedom), filtered by the plant of the model.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.linalg import expm
from scipy.signal import dlsim

from channel.codec.codec import Codec
from channel.codec.signals import signals_of
from channel.flight_log import FlightLog
from plant_sim.encoder import OutputReader
from tenbaud.bounds.linear import Matrix
from tenbaud.build.signals import build_encoders
from tenbaud.config.schema import FlightConfig
from tenbaud.design.described import plant_of
from tenbaud.studies.settings import StudyError

DEGREES = 2.0
"""of freedom of Student's t: the variance of the shoves has no bound"""
FORGOTTEN_S = 5.0
"""time in which an added shove decays by e at the slowest, where the plant itself keeps or grows it"""


@dataclass(frozen=True, slots=True)
class Augment:
    """The variants of a record."""

    scales: tuple[float, ...] = (0.6, 1.0, 2.0)
    """sizes that it is flown at"""
    shoves: float = 1.0
    """rms of the shoves added to the record at each size once more, as a share of its own motion; 0:
    none"""
    phases: int = 5
    """sample phases, at most: ticks, evenly over a sample, on which the first word is sent"""
    seed: int = 1

    def __post_init__(self) -> None:
        if not self.scales or min(self.scales) <= 0.0:
            raise StudyError(f"scales are sizes above 0, got {self.scales}")
        if self.shoves < 0.0 or self.phases < 1:
            raise StudyError("shoves are at least 0, and there is 1 phase or more")


class Variant(NamedTuple):
    """A record, and its variants."""

    log: FlightLog
    size: float
    """its motion in units of the recorded one, which its errors are measured by"""
    scale: float
    """of its commands"""


def variants_of(config: FlightConfig, codec: Codec, log: FlightLog, augment: Augment) -> list[Variant]:
    """Return the variants of a record, the same for the same seed."""
    encoders = build_encoders(config, signals_of(codec.model))
    measured = log.measured
    rest = np.array(codec.model.measured(codec.model.initial()))
    motion = measured - measured.mean(axis=0)
    own = float(np.sqrt(np.mean(motion**2)))
    random = np.random.default_rng(augment.seed)
    found = []
    for scale in augment.scales:
        for added in _added(config, motion, augment, random):
            values = rest + scale * (measured - rest + added)
            moved = float(np.sqrt(np.mean((scale * (motion + added)) ** 2)))
            changed = replace(log, measured=_read(encoders, values), commands=scale * log.commands)
            found.append(Variant(changed, moved / own if own else scale, scale))
    return found


def phases_of(config: FlightConfig, most: int) -> list[int]:
    """Return the sample phases that are flown: ticks, evenly over a sample, `most` at most."""
    ticks = round(config.timing.symbol_period_s / config.timing.tick_s)
    return [phase * ticks // min(most, ticks) for phase in range(min(most, ticks))]


def liveliest(log: FlightLog, ticks: int) -> int:
    """Return the row at which that many begin that move most; 0 where there are no more."""
    if len(log) <= ticks:
        return 0
    starts = range(0, len(log) - ticks + 1, ticks // 2)
    moved = [float(log.measured[at : at + ticks].std(axis=0).sum()) for at in starts]
    return starts[int(np.argmax(moved))]


def rows(log: FlightLog, first: int, last: int | None = None) -> FlightLog:
    """Return the rows of a record from `first` to before `last`."""
    parts = {name: getattr(log, name)[first:last] for name in ("measured", "counts", "commands")}
    return replace(log, **parts)


def _read(encoders: Sequence[OutputReader], values: Matrix) -> Matrix:
    """Return outputs as their encoders read them."""
    read = values.copy()
    for one, column in zip(encoders, read.T, strict=True):
        if one.step:
            column[:] = np.rint(column / one.step) * one.step
    return read


def _added(
    config: FlightConfig, motion: Matrix, augment: Augment, random: np.random.Generator
) -> Iterator[Matrix]:
    """Yield the additions to the outputs: nothing, and then random pushes."""
    yield np.zeros_like(motion)
    plant = plant_of(config.model, config.timing.tick_s)
    if plant is None or not augment.shoves:
        return
    F = expm(plant.A * config.timing.tick_s)
    largest = max(abs(np.linalg.eigvals(F)))
    F *= min(1.0, np.exp(-config.timing.tick_s / FORGOTTEN_S) / largest)
    pushes = random.standard_t(DEGREES, (len(motion), plant.G.shape[1])) * np.sqrt(plant.densities)
    system = (F, F @ plant.G, plant.C, np.zeros((len(plant.C), plant.G.shape[1])), 1.0)
    shoved = np.asarray(dlsim(system, pushes)[1])
    for output, own in zip(shoved.T, motion.T, strict=True):
        output *= augment.shoves * own.std() / max(output.std(), 1e-300)
    yield shoved
