"""Flights near the data-rate theorem: how many stay up, and how good they are, against R over R0.

Each rate has its own coder, designed for the preset's model. `exact`: the simulated plant is that model
and its outputs are read exactly, so that the line alone limits; otherwise it is the preset's own, with
lag, friction and encoders. A flight has fallen when the pendulum was ever more than `FALLEN_RAD` from
upright, or when the ends gave up. What is flown is kept point by point, and not flown again.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from reproduction.studies.kept import Kept, OnProgress
from tenbaud.bounds.floor import floor
from tenbaud.bounds.linear import rate_needed
from tenbaud.config.load import ConfigError, load_config, merged_values
from tenbaud.config.schema import FlightConfig
from tenbaud.design.complete import completed
from tenbaud.design.described import plant_of
from tenbaud.studies.figures import FlightFigures
from tenbaud.studies.flights import CompiledPoint
from tenbaud.studies.plain import fly_plain
from tenbaud.studies.schedule import Uncommon

TICK_S = 0.004
"""longest tick"""
FALLEN_RAD = 1.0
FIRST_SEED = 1001
"""none of those on which constants were chosen"""
COMPILED_FROM_S = 500.0
"""time of all flights of a point, from which compiling takes less time than flying with the sessions"""
RATIOS = (1.0, 1.05, 1.1, 1.15, 1.2, 1.3, 1.4, 1.5, 1.75, 2.0)
"""R over R0"""
EXACT: dict[str, Any] = {"encoders": {"quantised": False}}


@dataclass(frozen=True, slots=True)
class Plant:
    """A plant of the figure."""

    preset: str
    upright: int
    """place of the output that is 0 upright"""
    exact: dict[str, Any]
    """section of the plant that is its model"""


PLANTS = {
    "pendulum": Plant(
        "pendulum-13baud", 0, {"options": {"motor_lag_s": 0.0, "friction_rad_per_s2": 0.0}}
    ),
    "furuta": Plant("furuta-50baud", 1, {"kind": "linear"}),
}


@dataclass(frozen=True, slots=True)
class Point:
    """What is flown with `seeds` seeds."""

    plant: str
    rate_bit_s: float
    exact: bool = True
    delivery: str = "start"
    known: bool = False
    """the coder knows the strength of the disturbance; otherwise it adapts"""
    mismatch: float = 0.0
    seeds: int = 100
    seconds: float = 600.0

    @property
    def ratio(self) -> float:
        """Return R over R0."""
        return self.rate_bit_s / smallest_rate(self.plant)


@dataclass(frozen=True, slots=True)
class Found:
    """What came of a point: flights that stayed up, and their rms error over the floor."""

    up: int
    mean: float = math.nan
    half: float = math.nan
    """half the width of the mean's 95 % interval"""
    refused: str = ""
    """why nothing was flown: no coder can hold the plant at this rate"""


@cache
def smallest_rate(plant: str) -> float:
    """Return R0, in bit/s."""
    config = load_config(PLANTS[plant].preset)
    described = plant_of(config.model, config.timing.tick_s)
    assert described is not None
    return rate_needed(described.A)


def sweep(seeds: dict[str, int], seconds: dict[str, float], ratios: tuple[float, ...]) -> list[Point]:
    """Return the points of the figure."""
    return [
        Point(
            plant,
            ratio * smallest_rate(plant),
            exact,
            delivery,
            seeds=seeds[plant],
            seconds=seconds[plant],
        )
        for plant in PLANTS
        for exact in (True, False)
        for delivery in ("start", "end")
        for ratio in ratios
    ]


def claims() -> list[Point]:
    """Return the points of the table: a hundred flights of ten minutes each."""
    rates = (12.7, 15.8, 20.0)
    exact = [Point("pendulum", rate, known=known) for known in (True, False) for rate in rates]
    own = [
        Point("pendulum", rate, False, mismatch=mismatch) for mismatch in (0.0, 0.05) for rate in rates
    ]
    end = [Point("pendulum", rate, delivery="end") for rate in (14.0, 15.0, 15.8, 17.0, 18.5, 20.0)]
    return [*exact, *own, *end, Point("furuta", 50.0, False)]


QUICK = sweep({"pendulum": 2, "furuta": 2}, {"pendulum": 5.0, "furuta": 3.0}, (1.0, 1.2, 2.0))
FULL = sweep({"pendulum": 20, "furuta": 10}, {"pendulum": 120.0, "furuta": 60.0}, RATIOS)


def configuration(point: Point) -> FlightConfig:
    """Return the configuration of a point; ConfigError where there is no coder for its rate."""
    plant = PLANTS[point.plant]
    ticks = math.ceil(1.0 / point.rate_bit_s / TICK_S - 1e-6)
    # Whole nanoseconds, rounded up: the line carries no more than its rate.
    tick_s = math.ceil(1e9 / point.rate_bit_s / ticks - 1e-6) / 1e9
    values = merged_values(plant.preset, None)
    values["timing"] = {"tick_s": tick_s, "symbol_period_s": round(tick_s * ticks, 9)}
    values["channel"] |= {"rate_baud": point.rate_bit_s, "delivery": point.delivery}
    transmitter = values["transmitter"]
    transmitter["plant"] |= {"mismatch": point.mismatch, **(plant.exact if point.exact else {})}
    if point.exact:
        transmitter |= EXACT
    values = completed(values)
    values["coder"]["adapts"] = not point.known
    return load_config(None, None, values | {"duration_s": point.seconds})


def fly(point: Point, compiled: bool | None = None) -> Found:
    """Fly a point.

    `compiled`: whether its flights are compiled. Not given: whether that takes less time; what is found
    is the same.
    """
    try:
        config = configuration(point)
    except ConfigError as error:
        return Found(0, refused=str(error))
    described = plant_of(config.model, config.timing.tick_s)
    assert described is not None
    least = floor(described.model(), point.rate_bit_s)
    if compiled is None:
        compiled = point.seeds * point.seconds >= COMPILED_FROM_S
    ratios = []
    for flown in _flown(config, range(FIRST_SEED, FIRST_SEED + point.seeds), compiled):
        outputs = flown.outputs
        if outputs[PLANTS[point.plant].upright].amplitude < FALLEN_RAD:
            squares = [
                weight * one.error_live_rms**2
                for weight, one in zip(described.weights, outputs, strict=True)
            ]
            ratios.append(math.sqrt(sum(squares) / least))
    if not ratios:
        return Found(0)
    mean = sum(ratios) / len(ratios)
    spread = math.sqrt(sum((one - mean) ** 2 for one in ratios) / max(1, len(ratios) - 1))
    return Found(len(ratios), mean, 1.96 * spread / math.sqrt(len(ratios)))


def _flown(config: FlightConfig, seeds: range, compiled: bool) -> Iterator[FlightFigures]:
    """Yield the figures of the flights in which the estimate stayed within its bounds."""
    if compiled:
        point = CompiledPoint(config, scored_from=0)
        for seed in seeds:
            with suppress(Uncommon):
                yield point.fly(seed)[0]
        return
    for seed in seeds:
        flown = fly_plain(config.model_copy(update={"seed": seed}), 0)
        if flown.outcome == "ok":
            yield flown


def fly_all(points: list[Point], path: Path, on_progress: OnProgress) -> dict[Point, Found]:
    """Fly what the file does not hold yet, and keep each point in it as it comes."""
    presets = [merged_values(plant.preset, None) for plant in PLANTS.values()]
    own = json.dumps(presets, sort_keys=True).encode() + Path(__file__).read_bytes()
    return Kept(path, Point, Found, own).fly_all(fly, points, on_progress)
