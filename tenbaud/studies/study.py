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

import json
import tomllib
from functools import lru_cache
from hashlib import blake2b
from pathlib import Path

from pydantic import ValidationError

from channel.codec.signals import Signal
from channel.errors import TenbaudError
from tenbaud.build.ends import check_parts
from tenbaud.config.schema import FlightConfig
from tenbaud.studies.figures import shared_parts
from tenbaud.studies.points import FLIGHTS_MAX, names_of, points_of
from tenbaud.studies.settings import StudyError, configured, in_words
from tenbaud.studies.study_file import StudyFile, Value, described

TICKS_MAX = 10_000_000
"""of one flight: its arrays then take a gigabyte"""

PARTS = {"timing", "limits", "model", "transmitter", "receiver", "flight_log", "link"}
"""Sections that rig and controller are built from."""


class Study:
    """A study, checked; it says what flight number `n` is.

    `allow_code`: classes from outside that its configurations name may be imported.
    """

    def __init__(
        self, file: StudyFile, folder: Path | None = None, *, allow_code: bool = False
    ) -> None:
        self._allow_code = allow_code
        self.file = file
        self.folder = folder or Path()
        self.seeds = file.seeds if isinstance(file.seeds, list) else list(range(1, file.seeds + 1))
        self.names = names_of(file)
        self.points = points_of(file)
        if self.flights > FLIGHTS_MAX:
            raise StudyError(f"{self.flights} flights; at most {FLIGHTS_MAX} make one study")
        self.outputs: tuple[Signal, ...] = ()
        """of the plant, alike at every point: results are columns by their names"""
        self.configs = [self._config(point) for point in self.points]

    @property
    def flights(self) -> int:
        return len(self.points) * len(self.seeds)

    @property
    def chunks(self) -> int:
        return -(-self.flights // self.file.chunk_flights)

    def chunk(self, index: int) -> range:
        size = self.file.chunk_flights
        return range(index * size, min((index + 1) * size, self.flights))

    def flight(self, number: int) -> tuple[int, int]:
        return number // len(self.seeds), self.seeds[number % len(self.seeds)]

    @property
    def digest(self) -> str:
        """Return a digest of all that the results depend on, except the software."""
        configs = [config.model_dump(mode="json") for config in self.configs]
        content = json.dumps([configs, self.seeds, self.file.engine, self.file.chunk_flights])
        return blake2b(content.encode(), digest_size=16).hexdigest()

    def _config(self, point: dict[str, Value]) -> FlightConfig:
        path = None if self.file.config is None else self.folder / self.file.config
        try:
            config = configured(
                self.file.preset, path, self.file.set, point, allow_code=self._allow_code
            )
            outputs = shared_parts(config).signals.outputs
            _check_parts(config.as_text(include=PARTS))
        except (TenbaudError, ValueError) as error:
            raise StudyError(f"the point {in_words(point)} is no flight: {error}") from error
        self.outputs = self.outputs or outputs
        first, other = ([one.label for one in each] for each in (self.outputs, outputs))
        if first != other:
            raise StudyError(
                f"the point {in_words(point)} flies a plant with the outputs {'; '.join(other)}, and "
                f"the first point, {in_words(self.points[0])}, one with {'; '.join(first)}: the "
                "columns of a study are of one plant, so make a study of each"
            )
        if config.duration_s / config.timing.tick_s > TICKS_MAX:
            raise StudyError(
                f"the point {in_words(point)}: duration_s = {config.duration_s:g} is more than "
                f"{TICKS_MAX} ticks of {config.timing.tick_s:g} s, which no flight of a study has"
            )
        return config


@lru_cache(maxsize=1024)
def _check_parts(parts: str) -> None:
    """Build the other parts of a flight, given its sections as JSON; ConfigError."""
    # What the study names was allowed, or refused, where its configurations were made.
    check_parts(FlightConfig.of_text(parts).allowing_code())


def read_study(path: Path, seeds: int | None = None, *, allow_code: bool = False) -> Study:
    """Return the study in a file; StudyError, naming the field, where it is none.

    `seeds`: number for each point, instead of the one in the file. `allow_code`: as for `Study`.
    """
    try:
        values = tomllib.loads(path.read_text(encoding="utf-8"))
        if seeds is not None:
            values["seeds"] = seeds
        return Study(StudyFile.model_validate(values), path.parent, allow_code=allow_code)
    except OSError as error:
        raise StudyError(f"cannot read the study {path}: {error.strerror}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise StudyError(f"{path} is not TOML: {error}") from error
    except ValidationError as error:
        raise StudyError(f"{path}:\n  {described(error)}") from error
    except StudyError as error:
        raise StudyError(f"{path}: {error}") from error
