"""A chunk: the flights of a study that one worker flies in one go."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from tenbaud.config.schema import FlightConfig
from tenbaud.studies.figures import FlightFigures
from tenbaud.studies.machine_code import sources_digest
from tenbaud.studies.settings import StudyError
from tenbaud.studies.study import Study


class ChunkTask(NamedTuple):
    """The job of a worker, which needs no file of the study."""

    chunk: int
    engine: str
    points: tuple[tuple[str, tuple[int, ...]], ...]
    """(configuration as JSON, seeds), in the order of the flights"""
    sources: str
    """digest of the sources that the others run"""


class ChunkResult(NamedTuple):
    """The result of a worker."""

    chunk: int
    figures: list[FlightFigures]


def task_of(study: Study, index: int) -> ChunkTask:
    """Return the task of a chunk."""
    by_point: dict[int, list[int]] = {}
    for number in study.chunk(index):
        point, seed = study.flight(number)
        by_point.setdefault(point, []).append(seed)
    points = tuple((study.configs[point].as_text(), tuple(seeds)) for point, seeds in by_point.items())
    return ChunkTask(index, study.file.engine, points, sources_digest())


def fly_chunk(task: ChunkTask) -> ChunkResult:
    """Fly a chunk. StudyError when this process runs other sources than the one that asked."""
    if task.sources != sources_digest():
        raise StudyError(
            "a worker runs another version of tenbaud than this process; install the same on all of "
            "them: their figures could differ"
        )
    figures: list[FlightFigures] = []
    for text, seeds in task.points:
        # What the study names was allowed, or refused, in the process that read it.
        config = FlightConfig.of_text(text).allowing_code()
        figures += fly_point(config, seeds, task.engine)
    return ChunkResult(task.chunk, figures)


def fly_point(config: FlightConfig, seeds: Sequence[int], engine: str) -> list[FlightFigures]:
    """Fly a configuration with these seeds; StudyError where `engine` is one that cannot."""
    from tenbaud.studies.plain import fly_plain

    if engine == "plain":
        return [fly_plain(config.model_copy(update={"seed": seed})) for seed in seeds]
    from tenbaud.studies.flights import CompiledPoint
    from tenbaud.studies.schedule import Uncommon

    try:
        point = CompiledPoint(config)
    except Uncommon as error:
        if engine == "compiled":
            raise StudyError(f'engine = "compiled" cannot fly {error}; use auto') from error
        why = str(error)
        return [fly_plain(config.model_copy(update={"seed": one}), why=why) for one in seeds]
    flown = []
    for seed in seeds:
        try:
            flown.append(point.fly(seed)[0])
        except Uncommon as error:
            # It leaves the common course: the nodes themselves fly it, slowly.
            flown.append(fly_plain(config.model_copy(update={"seed": seed}), why=str(error)))
    return flown
