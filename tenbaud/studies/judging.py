"""Flights on which constants are fitted, and others on which they are judged.

On simulated flights, one set of seeds is for the fit and another for the judgement. On a recorded
flight, the first part is for the fit and the rest for the judgement; there the codec flies through the
whole recording and only the rest counts. The measure is the rms error of the receiver's predicted
estimate, of several outputs together by the weights of the model.
"""

from __future__ import annotations

import math
import operator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, NamedTuple

from tenbaud.build.flight import ticks_of
from tenbaud.build.flight_log import read_flight_log
from tenbaud.config.schema import FlightConfig
from tenbaud.design.described import linear_of
from tenbaud.studies.chunk import fly_point
from tenbaud.studies.figures import FlightFigures
from tenbaud.studies.flights import CompiledPoint
from tenbaud.studies.plain import fly_plain
from tenbaud.studies.schedule import Uncommon
from tenbaud.studies.settings import StudyError, configured
from tenbaud.studies.study_file import Range

Method = Literal["differential-evolution", "nelder-mead"]

PENALTY_RAD = 100.0
"""The error that counts for a flight without figures: larger than any error of an angle of weight 1."""


class Split(NamedTuple):
    """The split of flights into those for the fit and those for the validation."""

    train_seeds: tuple[int, ...]
    test_seeds: tuple[int, ...]
    train_share: float
    """of a recorded flight"""


@dataclass(frozen=True, slots=True)
class Tuning:
    """A fit: of which constants, on which flights, how."""

    preset: str | None
    file: Path | None
    overrides: dict[str, Any]
    free: dict[str, Range]
    split: Split
    method: Method = "differential-evolution"
    evaluations: int = 600
    """sets of constants to fly at most, those that are configured included"""
    seed: int = 1
    allow_code: bool = False
    """whether classes from outside that the configuration names may be imported"""

    def config(self, values: dict[str, float]) -> FlightConfig:
        """Return the configuration with these constants; ConfigError where there is none.

        A simulated plant stays what it is when the model is moved.
        """
        fitted = any(name.startswith("model.") for name in values)
        plant = self._plant() if fitted else {}
        settings = {**plant, **values}
        return configured(self.preset, self.file, self.overrides, settings, allow_code=self.allow_code)

    def _plant(self) -> dict[str, Any]:
        config = self.config({})
        if config.model.kind != "pitch" or config.transmitter.plant.relative_to == "pitch":
            return {}
        where = "transmitter.plant"
        return {
            f"{where}.relative_to": "pitch",
            **{f"{where}.pitch.{name}": value for name, value in config.model.model_dump().items()},
        }


class Judged(NamedTuple):
    """The result of the flights of one part of a split."""

    rms_rad: float
    """over all of them; one without figures counts as `PENALTY_RAD`"""
    lost: int
    """flights without figures"""
    flights: int
    reason: str
    """why the first of those has none"""


def judge(tuning: Tuning, values: dict[str, float], *, train: bool) -> Judged:
    """Fly constants on the flights for the fit, or on those for the judgement.

    ConfigError, StudyError and the like where these constants make no flight at all.
    """
    config = tuning.config(values)
    linear = linear_of(config.model)
    weights = (1.0,) if linear is None else linear.weights
    if config.transmitter.rig == "replay":
        figures = [_fly_part(config, tuning.split.train_share, train=train)]
    else:
        seeds = tuning.split.train_seeds if train else tuning.split.test_seeds
        figures = fly_point(config, seeds, "auto")
    squares, lost, reason = 0.0, 0, ""
    for one in figures:
        # One weight serves all outputs.
        each = weights * len(one.outputs) if len(weights) == 1 else weights
        errors = [output.error_live_rms for output in one.outputs]
        rms = math.hypot(*map(operator.mul, map(math.sqrt, each), errors))
        if one.outcome == "ok" and math.isfinite(rms):
            squares += min(rms, PENALTY_RAD) ** 2
        else:
            squares += PENALTY_RAD**2
            why = "nothing of it was scored" if one.outcome == "ok" else one.outcome
            reason = reason or why
            lost += 1
    return Judged(math.sqrt(squares / len(figures)), lost, len(figures), reason)


def _fly_part(config: FlightConfig, share: float, *, train: bool) -> FlightFigures:
    """Fly a recording's first part; or fly through all of it and score the rest."""
    border, ticks = split_ticks(config, share)
    until = border if train else ticks
    config = config.model_copy(update={"duration_s": until * config.timing.tick_s})
    start = 0 if train else border
    try:
        return CompiledPoint(config, start).fly(config.seed)[0]
    except Uncommon:
        return fly_plain(config, start)


def split_ticks(config: FlightConfig, share: float) -> tuple[int, int]:
    """Return (ticks for the fit, ticks in all) of a recorded flight, as far as it is to be flown.

    StudyError when a part of it has nothing to score.
    """
    ticks = min(len(read_flight_log(config)), ticks_of(config.duration_s, config))
    border = math.floor(share * ticks)
    lead = config.timing.lead_ticks
    if min(border, ticks - border) <= (0 if lead == "auto" else lead):
        raise StudyError(
            f"{ticks} ticks of the recording are too few to be split at {100.0 * share:g} %: fly more "
            "of it (duration_s), or change --train-share"
        )
    return border, ticks
