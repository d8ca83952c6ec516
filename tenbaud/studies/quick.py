"""Coder constants for a recorded flight within seconds, written by `tenbaud identify` beside a model.

The model is given. A few numbers of a coder that suits it (`families`) are fitted to variants of the
record (`records`), with a bounded number of flights.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
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
from tenbaud.studies.judging import PHASES_MAX, Judged, score, weights_of
from tenbaud.studies.records import Augment, Variant, liveliest, phases_of, rows, variants_of
from tenbaud.studies.schedule import Uncommon
from tenbaud.studies.search import OnEvaluation, Spent, Trials, minimise
from tenbaud.studies.settings import StudyError

WINDOW_TICKS = 10_000
"""of the record that are flown, where it moves most"""
BUDGET_TICKS = 60_000_000
"""of all flights together: some ten seconds"""
EVALUATIONS_MAX = 400
AUGMENT = Augment(phases=3)
SAMPLES_MIN = 20
"""of the part of a record that constants can be fitted to"""


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
        found = _best(config, log, family, on_evaluation)
        bench = Bench(found, [Variant(log, 1.0, 1.0)], phases_of(found, PHASES_MAX), 0, 1)
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


def _best(
    config: FlightConfig, log: FlightLog, family: Family, on_evaluation: OnEvaluation
) -> FlightConfig:
    """Return the configuration of a family with the least error; StudyError where none flies."""
    variants = variants_of(config, shared_parts(config).codec, log, AUGMENT)
    bench = Bench(config, variants, phases_of(config, AUGMENT.phases), 0, 1)
    weights = weights_of(config)

    def judge(tried: FlightConfig) -> Judged:
        return score(bench.fly(tried), bench.sizes, weights)

    budget = min(BUDGET_TICKS // (len(log) * len(bench.sizes)), EVALUATIONS_MAX)
    most = max(2 * len(family.scan), budget)
    none = Judged(math.inf, 0, 0, "")
    trials = Trials(judge, most, on_evaluation, none, config, math.inf, keeps_lost=False)

    def error_at(shares: Sequence[float]) -> float:
        return trials.error_of(lambda: family.at(shares))

    errors = [error_at(one) for one in family.scan]
    if trials.best is none:
        raise StudyError(
            f"no coder constants fly this record with this model: {trials.last_reason}; check the "
            "model, the units and the signs of the record"
        )
    with suppress(Spent):
        minimise(error_at, family.scan[int(np.argmin(errors))], AUGMENT.seed)
    return trials.found
