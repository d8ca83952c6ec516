"""A study: which flights, with which settings and seeds. Read from one TOML file.

    name = "mismatch-and-rate"
    preset = "paper-10baud"          # or: config = "flight.toml", beside the study
    seeds = 20                       # of each point: 1 ... 20; or a list of seeds

    [set]                            # for every flight, as in a configuration
    duration_s = 60.0

    [grid]                           # every combination of these
    mismatch = [0.0, 0.1, 0.2]
    rate = { from = 5, to = 40, steps = 4, scale = "log" }

    [sample]                         # or points within ranges; with a grid: at each of its points
    method = "sobol"                 # or "random"
    points = 64
    seed = 1
    settings."coder.decay" = { from = 0.8, to = 0.99 }

Point and seed of a flight follow from its number alone, whatever the workers.
"""

from __future__ import annotations

import itertools
import json
import math
import tomllib
from hashlib import blake2b
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationError, field_validator, model_validator

from tenbaud.config.load import ConfigError
from tenbaud.config.schema import FlightConfig
from tenbaud.config.section import Section
from tenbaud.studies.figures import shared_parts
from tenbaud.studies.settings import StudyError, check_name, configured

FLIGHTS_MAX = 10_000_000

Value = bool | int | float | str


class Range(Section):
    """Values between two ends."""

    first: float = Field(alias="from")
    last: float = Field(alias="to")
    steps: Annotated[int, Field(ge=2, le=100_000)] | None = None
    """for a grid: how many values, ends included"""
    scale: Literal["linear", "log"] = "linear"

    @model_validator(mode="after")
    def _sensible(self) -> Range:
        if self.scale == "log" and not (self.first > 0.0 and self.last > 0.0):
            raise ValueError("a range on a log scale has both ends above 0")
        if self.first == self.last:
            raise ValueError(f"the range from {self.first:g} to {self.last:g} holds one value only")
        return self

    def at(self, share: float) -> float:
        """Return the value at a share of the way, 0 to 1."""
        if share in (0.0, 1.0):
            return self.last if share else self.first
        if self.scale == "log":
            return math.exp(math.log(self.first) * (1.0 - share) + math.log(self.last) * share)
        return self.first * (1.0 - share) + self.last * share


class SampleSection(Section):
    """Points within ranges, rather than on a grid."""

    method: Literal["sobol", "random"] = "sobol"
    points: Annotated[int, Field(ge=1, le=1_000_000)]
    seed: Annotated[int, Field(ge=0)] = 1
    settings: dict[str, Range]


class StudyFile(Section):
    """The study as it is written."""

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9_.-]+$")] = "study"
    description: str = ""
    preset: str | None = None
    config: str | None = None
    seeds: Annotated[int, Field(ge=1, le=1_000_000)] | list[Annotated[int, Field(ge=0, lt=2**63)]] = 1
    engine: Literal["auto", "compiled", "plain"] = "auto"
    chunk_flights: Annotated[int, Field(ge=1, le=1_000_000)] = 100
    """flights that are computed, and kept, together"""
    set: dict[str, Any] = Field(default_factory=dict)
    grid: dict[str, list[Value] | Range] = Field(default_factory=dict)
    sample: SampleSection | None = None

    @field_validator("seeds")
    @classmethod
    def _distinct(cls, seeds: int | list[int]) -> int | list[int]:
        if isinstance(seeds, list) and (not seeds or len(set(seeds)) < len(seeds)):
            raise ValueError("seeds are at least one, and none twice")
        return seeds


class Study:
    """A study, checked; it says what flight number `n` is."""

    def __init__(self, file: StudyFile, folder: Path | None = None) -> None:
        self.file = file
        self.folder = folder or Path()
        self.seeds = file.seeds if isinstance(file.seeds, list) else list(range(1, file.seeds + 1))
        self.names = _names(file)
        self.points = _points(file)
        if self.flights > FLIGHTS_MAX:
            raise StudyError(f"{self.flights} flights; at most {FLIGHTS_MAX} make one study")
        self.configs = [self._config(point) for point in self.points]

    @property
    def flights(self) -> int:
        """Return how many flights the study has."""
        return len(self.points) * len(self.seeds)

    @property
    def chunks(self) -> int:
        """Return how many chunks they make."""
        return -(-self.flights // self.file.chunk_flights)

    def chunk(self, index: int) -> range:
        """Return the numbers of a chunk's flights."""
        size = self.file.chunk_flights
        return range(index * size, min((index + 1) * size, self.flights))

    def flight(self, number: int) -> tuple[int, int]:
        """Return (point, seed) of a flight."""
        return number // len(self.seeds), self.seeds[number % len(self.seeds)]

    @property
    def digest(self) -> str:
        """Return what stands for all that the results depend on, but the software."""
        configs = [config.model_dump(mode="json") for config in self.configs]
        content = json.dumps([configs, self.seeds, self.file.engine, self.file.chunk_flights])
        return blake2b(content.encode(), digest_size=16).hexdigest()

    def _config(self, point: dict[str, Value]) -> FlightConfig:
        path = None if self.file.config is None else self.folder / self.file.config
        try:
            config = configured(self.file.preset, path, self.file.set, point)
            shared_parts(config)
        except ConfigError as error:
            raise StudyError(f"the point {point} is no flight: {error}") from error
        return config


def read_study(path: Path, seeds: int | None = None) -> Study:
    """Return the study in a file; StudyError, naming the field, where it is none.

    `seeds`: so many of each point, instead of what the file says.
    """
    try:
        values = tomllib.loads(path.read_text(encoding="utf-8"))
        if seeds is not None:
            values["seeds"] = seeds
        return Study(StudyFile.model_validate(values), path.parent)
    except OSError as error:
        raise StudyError(f"cannot read the study {path}: {error.strerror}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise StudyError(f"{path} is not TOML: {error}") from error
    except ValidationError as error:
        raise StudyError(f"{path}:\n  {_described(error)}") from error
    except StudyError as error:
        raise StudyError(f"{path}: {error}") from error


def _described(error: ValidationError) -> str:
    lines: dict[str, None] = {}
    for detail in error.errors():
        place = ".".join(str(part) for part in detail["loc"] if part not in ("Range", "list"))
        message = detail["msg"].removeprefix("Value error, ")
        if detail["type"] == "extra_forbidden":
            message = f"unknown; a study has {', '.join(StudyFile.model_fields)}"
        lines[f"{place}: {message}"] = None
    return "\n  ".join(lines)


def _names(file: StudyFile) -> list[str]:
    names = [*file.grid, *(file.sample.settings if file.sample else ())]
    if not names:
        raise StudyError("nothing is swept: give a [grid], or a [sample] with settings")
    if file.sample is not None and not file.sample.settings:
        raise StudyError("sample.settings is empty: name what is to be sampled, within which range")
    for name in names:
        check_name(name)
        if name in ("seed", "preset", "link.kind"):
            raise StudyError(f"{name} cannot be swept" + ("; use seeds" if name == "seed" else ""))
    twice = {name for name in names if names.count(name) > 1}
    if twice:
        raise StudyError(f"{', '.join(sorted(twice))}: on the grid and sampled at once")
    for one, other in (
        ("rate", "timing.symbol_period_s"),
        ("rate", "channel.rate_baud"),
        ("mismatch", "transmitter.plant.mismatch"),
        ("density", "transmitter.plant.disturbance"),
        *((name, "link.impairments") for name in ("loss", "flip", "delay")),
    ):
        if one in names and other in names:
            raise StudyError(f"{one} and {other} set the same thing: sweep one of them")
    return names


def _points(file: StudyFile) -> list[dict[str, Value]]:
    axes: list[list[Value]] = []
    for name, values in file.grid.items():
        if isinstance(values, Range):
            if values.steps is None:
                raise StudyError(f"grid.{name}: a range on a grid needs steps")
            last = values.steps - 1
            axes.append([values.at(step / last) for step in range(values.steps)])
        elif not values:
            raise StudyError(f"grid.{name} is an empty list: no flight comes of it")
        elif len(set(values)) < len(values):
            raise StudyError(f"grid.{name} names a value twice")
        else:
            axes.append(list(values))
    count = math.prod(len(axis) for axis in axes) * (file.sample.points if file.sample else 1)
    if count > FLIGHTS_MAX:
        raise StudyError(f"{count} points; at most {FLIGHTS_MAX} flights make one study")
    grid = [dict(zip(file.grid, values, strict=True)) for values in itertools.product(*axes)]
    return [{**one, **other} for one in grid for other in _sampled(file.sample)]


def _sampled(sample: SampleSection | None) -> list[dict[str, Value]]:
    if sample is None:
        return [{}]
    import numpy as np
    from scipy.stats import qmc

    size = len(sample.settings)
    if sample.method == "sobol":
        engine = qmc.Sobol(size, rng=np.random.default_rng(sample.seed))
        bits = max(0, (sample.points - 1).bit_length())
        # A whole power of two is what balances a Sobol sequence; what is left over is not flown.
        shares = engine.random_base2(bits)[: sample.points]
    else:
        shares = np.random.default_rng(sample.seed).random((sample.points, size))
    return [
        {
            name: one.at(float(share))
            for (name, one), share in zip(sample.settings.items(), row, strict=True)
        }
        for row in shares
    ]
