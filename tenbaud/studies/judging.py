"""Flights on which constants are fitted, and others on which they are judged.

On simulated flights, one set of seeds is for the fit and another for the judgement. On a recorded
flight, the first part is for the fit (of a long one, where it moves most), at several sizes, with
shoves added and from several sample phases (`records`); the rest is for the judgement, as it was
recorded and from every phase: there the codec flies through the whole recording and only the rest
counts. The measure is the rms error of the receiver's predicted estimate, of several outputs together
by the weights of the model.
"""

from __future__ import annotations

import math
import operator
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np

from channel.errors import TenbaudError
from tenbaud.build.codec import build_codec
from tenbaud.build.flight import ticks_of
from tenbaud.build.flight_log import read_flight_log
from tenbaud.build.recorded import start_at
from tenbaud.config.schema import FlightConfig
from tenbaud.design.described import linear_of
from tenbaud.studies.bench import Bench
from tenbaud.studies.chunk import fly_point
from tenbaud.studies.constants import changed
from tenbaud.studies.figures import FlightFigures
from tenbaud.studies.plain import fly_plain
from tenbaud.studies.records import Augment, Variant, liveliest, phases_of, rows, variants_of
from tenbaud.studies.schedule import Uncommon
from tenbaud.studies.settings import StudyError, configured
from tenbaud.studies.study_file import Range

Method = Literal["cma-es", "nelder-mead"]

PENALTY_RAD = 100.0
"""The error that counts for a flight without figures: larger than any error of an angle of weight 1."""
FIT_TICKS = 100_000
"""of a recorded flight that are fitted, at most"""
PHASES_MAX = 50
"""sample phases of the judgement"""
NO_CONSTANTS = (TenbaudError, ValueError, ArithmeticError, np.linalg.LinAlgError)
"""exceptions for constants that allow no coder, model or observer"""
NOTABLE = 0.005
"""share by which an error must rise to be another one"""


class Split(NamedTuple):
    """The split of flights into those for the fit and those for the validation."""

    train_seeds: tuple[int, ...]
    test_seeds: tuple[int, ...]
    train_share: float
    """of a recorded flight"""


def split_of(seeds: int, test_seeds: int, train_share: float) -> Split:
    """Return the split with the first seeds for the fit and the next ones for the validation."""
    border = seeds + 1
    return Split(tuple(range(1, border)), tuple(range(border, border + test_seeds)), train_share)


@dataclass(frozen=True)
class Tuning:
    """A fit: of which constants, on which flights, how."""

    preset: str | None
    file: Path | None
    overrides: dict[str, Any]
    free: dict[str, Range]
    split: Split
    method: Method = "cma-es"
    evaluations: int = 600
    """sets of constants to fly at most, those that are configured included"""
    seed: int = 1
    allow_code: bool = False
    """whether classes from outside that the configuration names may be imported"""
    augment: Augment = field(default_factory=Augment)

    def config(self, values: dict[str, float]) -> FlightConfig:
        """Return the configuration with these constants; ConfigError where there is none.

        A simulated plant stays what it is when the model is moved.
        """
        fitted = any(name.startswith("model.") for name in values)
        return changed(self._with_own_plant if fitted else self._configured, values)

    @cached_property
    def _configured(self) -> FlightConfig:
        return configured(self.preset, self.file, self.overrides, {}, allow_code=self.allow_code)

    @cached_property
    def _with_own_plant(self) -> FlightConfig:
        config = self._configured
        if config.model.kind != "pitch" or config.transmitter.plant.relative_to == "pitch":
            return config
        plant = {"relative_to": "pitch", "pitch": config.model.model_dump()}
        overrides = {f"transmitter.plant.{name}": value for name, value in plant.items()}
        return configured(self.preset, self.file, self.overrides, overrides, allow_code=self.allow_code)


class Judged(NamedTuple):
    """The result of the flights of one part of a split."""

    rms_rad: float
    """over all of them; one without figures counts as `PENALTY_RAD`"""
    lost: int
    """flights without figures"""
    flights: int
    reason: str
    """why the first of those has none"""
    each: tuple[float, ...] = ()
    """rms error of each flight: of each seed, or of each sample phase of a recording"""
    largest: float = math.nan
    """error of the first output, over all flights"""
    amplitude: float = math.nan
    """largest value of that output"""


def is_worse(before: Judged, after: Judged) -> bool:
    """Return whether an error rose by more than its digits and its spread over the flights explain."""
    more = np.subtract(after.each, before.each)
    spread = float(more.std(ddof=1)) / math.sqrt(len(more)) if len(more) > 1 else 0.0
    return after.rms_rad - before.rms_rad > max(2.0 * spread, NOTABLE * before.rms_rad)


class Judge:
    """Flies constants on the flights for the fit, or on those for the judgement."""

    def __init__(self, tuning: Tuning) -> None:
        """Read the recording, if it is one; StudyError where a part of it has nothing to score."""
        self._tuning = tuning
        config = tuning.config({})
        self._weights = weights_of(config)
        self.recorded = config.transmitter.rig == "replay"
        self.border = self.ticks = self._first = 0
        self._start: dict[str, Any] = {}
        if self.recorded:
            self.border, self.ticks = split_ticks(config, tuning.split.train_share)
            log = rows(read_flight_log(config), 0, self.border)
            if first := liveliest(log, FIT_TICKS):
                self._first, self._start = first, start_at(config, rows(log, first))

    def __call__(self, values: dict[str, float], *, train: bool) -> Judged:
        """Fly constants; ConfigError, StudyError and the like where they make no flight at all."""
        config = self._tuning.config(values)
        if not self.recorded:
            split = self._tuning.split
            seeds = split.train_seeds if train else split.test_seeds
            return score(fly_point(config, seeds, "auto"), None, self._weights)
        bench = self._train if train else self._test
        if bench is not None:
            config = changed(config, self._start) if train else config
            return score(
                bench.fly(config), bench.sizes if train else None, self._weights, mean=not train
            )
        until = self.border if train else self.ticks
        config = config.model_copy(update={"duration_s": until * config.timing.tick_s})
        return score([fly_plain(config, 0 if train else self.border)], None, self._weights)

    @property
    def fit(self) -> tuple[int, int]:
        """Return the ticks between which a recorded flight is fitted."""
        if self._train is None:
            return 0, self.border  # the nodes begin where the recording does
        return self._first, min(self._first + FIT_TICKS, self.border)

    @cached_property
    def _train(self) -> Bench | None:
        augment = self._tuning.augment
        config = changed(self._tuning.config({}), self._start)
        log = rows(read_flight_log(config), self._first, min(self._first + FIT_TICKS, self.border))
        return self._bench(variants_of(config, build_codec(config), log, augment), augment.phases, 0)

    @cached_property
    def _test(self) -> Bench | None:
        log = rows(read_flight_log(self._tuning.config({})), 0, self.ticks)
        return self._bench([Variant(log, 1.0, 1.0)], PHASES_MAX, self.border)

    def _bench(self, variants: list[Variant], phases: int, scored_from: int) -> Bench | None:
        """Return the flights of a part; None where only the nodes can fly them."""
        config = self._tuning.config({})
        try:
            return Bench(config, variants, phases_of(config, phases), scored_from)
        except Uncommon:
            return None


def weights_of(config: FlightConfig) -> tuple[float, ...]:
    """Return the weights of the outputs' squared errors; one for all, where the model has no others."""
    linear = linear_of(config.model)
    return (1.0,) if linear is None else linear.weights


def score(
    figures: list[FlightFigures],
    sizes: list[float] | None,
    weights: tuple[float, ...],
    *,
    mean: bool = False,
) -> Judged:
    """Return the error of flights, each in units of its size; `mean`: of their errors, not squares."""
    errors, lost = [], []
    for one, size in zip(figures, sizes or [1.0] * len(figures), strict=True):
        # One weight serves all outputs.
        each = weights * len(one.outputs) if len(weights) == 1 else weights
        rms = [output.error_live_rms for output in one.outputs]
        error = math.hypot(*map(operator.mul, map(math.sqrt, each), rms)) / size
        if one.outcome != "ok" or not math.isfinite(error):
            lost.append("nothing of it was scored" if one.outcome == "ok" else one.outcome)
            error = PENALTY_RAD
        errors.append(min(error, PENALTY_RAD))
    total = math.fsum(error if mean else error * error for error in errors) / len(errors)
    return Judged(
        rms_rad=total if mean else math.sqrt(total),
        lost=len(lost),
        flights=len(errors),
        reason=lost[0] if lost else "",
        each=tuple(errors),
        largest=max(one.first.error_live_max for one in figures),
        amplitude=max(one.first.amplitude for one in figures),
    )


def split_ticks(config: FlightConfig, share: float) -> tuple[int, int]:
    """Return (ticks for the fit, ticks in all) of a recorded flight, as far as it is to be flown.

    StudyError when a part of it has nothing to score.
    """
    ticks = min(len(read_flight_log(config)), ticks_of(config.duration_s, config))
    border = math.floor(share * ticks)
    timing = config.timing
    # Every phase leaves at least a sample of each part.
    least = 2 * round(timing.symbol_period_s / timing.tick_s)
    least += 0 if timing.lead_ticks == "auto" else timing.lead_ticks
    if min(border, ticks - border) < least:
        raise StudyError(
            f"{ticks} ticks of the recording are too few to be split at {100.0 * share:g} %: fly more "
            "of it (duration_s), or change --train-share"
        )
    return border, ticks
