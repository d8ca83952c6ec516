"""Coder constants for a recorded flight within seconds, written by `tenbaud identify` beside a model.

The model is given. A few numbers of a coder that suits it (`families`) are fitted to variants of the
record (`records`), with a bounded number of flights.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any, NamedTuple

import numpy as np

from channel.flight_log import FlightLog
from tenbaud.build.flight_log import read_flight_log
from tenbaud.build.recorded import start_at
from tenbaud.config.schema import FlightConfig
from tenbaud.studies.bench import Bench
from tenbaud.studies.constants import BANDWIDTH, changed
from tenbaud.studies.families import Family, family_of
from tenbaud.studies.figures import shared_parts
from tenbaud.studies.judging import NO_CONSTANTS, PHASES_MAX, score, weights_of
from tenbaud.studies.records import Augment, Variant, liveliest, phases_of, rows, variants_of
from tenbaud.studies.schedule import Uncommon
from tenbaud.studies.search import minimise
from tenbaud.studies.settings import StudyError

WINDOW_TICKS = 10_000
"""of the record that are flown, where it moves most"""
BUDGET_TICKS = 60_000_000
"""of all flights together: some ten seconds"""
EVALUATIONS_MAX = 400
AUGMENT = Augment(phases=3)
SAMPLES_MIN = 20
"""of the part of a record that constants can be fitted to"""

OnEvaluation = Callable[[int, float], None]


class QuickCoder(NamedTuple):
    """Constants that suit a record, and the errors of the record flown with them from every phase."""

    sections: dict[str, Any]
    """the sections `model`, `coder` and, but for linear models, `transmitter`"""
    rms: tuple[float, ...]
    """per output, in its unit: mean of the sample phases"""
    largest: tuple[float, ...]
    """of all phases"""


def quick_coder(
    config: FlightConfig,
    *,
    until_s: float | None = None,
    on_evaluation: OnEvaluation = lambda _count, _error: None,
    cores: int = 1,
) -> QuickCoder:
    """Return coder constants for the model of a configuration on its recorded flight.

    `until_s`: only the record's beginning is looked at, up to this time after its first row.
    `on_evaluation` gets the sets of constants flown and the smallest error so far. StudyError or
    ConfigError, in words, where no constants are found.
    """
    config = changed(config, {"transmitter.rig": "replay", "receiver.controller": "recorded"})
    family = family_of(config)
    config = family.at(family.scan[len(family.scan) // 2])
    log, timing = read_flight_log(config), config.timing
    if until_s is not None:
        log = rows(log, 0, max(0, round(until_s / timing.tick_s)))
    first = liveliest(log, WINDOW_TICKS)
    log = rows(log, first, first + WINDOW_TICKS)
    own = config.model
    if first:
        config = changed(config, start_at(config, log))
        family = family_of(config)
    samples = len(log) * timing.tick_s / timing.symbol_period_s
    if samples < SAMPLES_MIN:
        raise StudyError(
            f"the record has {samples:.0f} samples of {timing.symbol_period_s:g} s; {SAMPLES_MIN} are "
            "needed to fit coder constants"
        )
    try:
        found = _Fit(config, log, family, on_evaluation, cores).best()
        bench = Bench(found, [Variant(log, 1.0, 1.0)], phases_of(found, PHASES_MAX), 0, cores)
    except Uncommon as error:
        raise StudyError(f"no coder constants are fitted for {error}") from error
    flown = bench.fly(found)
    if bad := [one.outcome for one in flown if not one.outputs]:
        raise StudyError(f"the constants that suit the record's variants do not fly it: {bad[0]}")
    outputs = list(zip(*[one.outputs for one in flown], strict=True))
    sections = found.model_dump(mode="json", include={"model", "coder"})
    if first:
        sections["model"]["start"] = list(getattr(own, "start", ()))
    if found.model.kind != "linear":
        name = BANDWIDTH.rpartition(".")[2]
        sections["transmitter"] = {name: getattr(found.transmitter, name)}
    return QuickCoder(
        sections,
        tuple([float(np.mean([one.error_live_rms for one in each])) for each in outputs]),
        tuple([max(one.error_live_max for one in each) for each in outputs]),
    )


class _Spent(Exception):
    """The record was flown often enough."""


class _Fit:
    """The flights of one fit, and the best configuration among them."""

    def __init__(
        self,
        config: FlightConfig,
        log: FlightLog,
        family: Family,
        on_evaluation: OnEvaluation,
        cores: int,
    ) -> None:
        self._family = family
        self._on_evaluation = on_evaluation
        variants = variants_of(config, shared_parts(config).codec, log, AUGMENT)
        self._bench = Bench(config, variants, phases_of(config, AUGMENT.phases), 0, cores)
        self._weights = weights_of(config)
        budget = BUDGET_TICKS // (len(log) * len(self._bench.sizes))
        self._left = max(2 * len(family.scan), min(budget, EVALUATIONS_MAX))
        self._count = 0
        self._least = math.inf
        self._found: FlightConfig | None = None
        self._reason = ""

    def best(self) -> FlightConfig:
        """Return the configuration with the least error; StudyError where none flies."""
        errors = [self._error_at(one) for one in self._family.scan]
        if self._found is None:
            raise StudyError(
                f"no coder constants fly this record with this model: {self._reason}; check the model, "
                "the units and the signs of the record"
            )
        with suppress(_Spent):
            minimise(self._error_at, self._family.scan[int(np.argmin(errors))], AUGMENT.seed)
        return self._found

    def _error_at(self, shares: Sequence[float]) -> float:
        if self._count >= self._left:
            raise _Spent
        self._count += 1
        try:
            config = self._family.at(shares)
            judged = score(self._bench.fly(config), self._bench.sizes, self._weights)
        except NO_CONSTANTS as error:
            self._reason = str(error)
            return math.inf
        self._reason = judged.reason or self._reason
        if judged.rms_rad < self._least and not judged.lost:
            self._least, self._found = judged.rms_rad, config
        self._on_evaluation(self._count, self._least)
        return judged.rms_rad
