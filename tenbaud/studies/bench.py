"""Records that are flown compiled with one set of constants after another, on all cores."""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any

import numpy as np

from tenbaud.build.ends import build_observer
from tenbaud.build.flight import Agreement
from tenbaud.config.schema import FlightConfig
from tenbaud.studies.arrays import observer_arrays
from tenbaud.studies.figures import FlightFigures, shared_parts
from tenbaud.studies.flights import CompiledPoint
from tenbaud.studies.records import Variant, rows
from tenbaud.studies.schedule import Uncommon

CORES = os.cpu_count() or 1


class Bench:
    """Variants of a record, each from several sample phases.

    Building it raises Uncommon where only the nodes can fly the configuration.
    """

    def __init__(
        self,
        config: FlightConfig,
        variants: Sequence[Variant],
        phases: Sequence[int],
        scored_from: int,
        cores: int = CORES,
    ) -> None:
        """Make every flight ready. `phases`: rows that are left out before the first word."""
        ticks = max(len(one.log) for one in variants)
        point = CompiledPoint(config.model_copy(update={"duration_s": ticks * config.timing.tick_s}))
        self.sizes: list[float] = []
        """of each flight's motion, in units of the recorded one"""
        self._points: list[CompiledPoint] = []
        self._cores = cores
        # Commands of a last sample that is cut short, once: the phases share the arrays.
        more = ((0, point.numbers.per_sample + point.numbers.lead), (0, 0))
        for log, size, scale in variants:
            if log.commands.size:
                log = replace(log, commands=np.pad(log.commands, more, mode="edge"))
            for phase in phases:
                one = point.on(rows(log, phase), max(scored_from - phase, 0))
                for name in ("command_max", "slew"):
                    one.steady[name] = one.steady[name] * max(1.0, scale)
                self._points.append(one)
                self.sizes.append(size)

    def fly(self, config: FlightConfig) -> list[FlightFigures]:
        """Fly every record with the constants of a configuration; ConfigError where they are none."""
        agreement = shared_parts(config)
        observer = observer_arrays(build_observer(agreement))
        with ThreadPoolExecutor(self._cores) as pool:
            return list(pool.map(lambda point: _fly(point, agreement, observer), self._points))


def _fly(point: CompiledPoint, agreement: Agreement, observer: dict[str, Any]) -> FlightFigures:
    point.use(agreement, observer)
    try:
        return point.fly(agreement.config.seed)[0]
    except Uncommon as error:
        return FlightFigures(str(error), "compiled", "", (), 0, 0, 0)
    finally:
        point.rest()
