"""Fitting constants of a coder, optionally of the model, on flights; validated on others."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from importlib import import_module
from typing import Any, NamedTuple

from tenbaud.build.signals import configured_signals
from tenbaud.config.load import flattened
from tenbaud.config.schema import FlightConfig
from tenbaud.studies.constants import BANDWIDTH, present
from tenbaud.studies.figures import shared_parts
from tenbaud.studies.judging import PENALTY_RAD, Judge, Tuning, is_worse
from tenbaud.studies.search import OnEvaluation, Spent, Trials, minimise
from tenbaud.studies.settings import StudyError
from tenbaud.studies.study_file import Range


class Tuned(NamedTuple):
    """The result. Errors are rms of the live estimate, in the units of the outputs."""

    values: dict[str, float]
    train_before: float
    test_before: float
    train_after: float
    test_after: float
    evaluations: int
    """sets of constants flown on the flights for the fit, those before included"""
    penalised: int
    """of these, how many made no flight or left some of the flights without figures"""
    without_figures: dict[str, int]
    """flights that count as `PENALTY_RAD` in one of the four errors, by its name"""
    train_what: str
    test_what: str
    test_each: tuple[float, ...]
    """rms errors after the fit, of each flight of the validation"""
    test_largest: float
    test_amplitude: float
    """largest error of the first output there, after the fit, and largest value of that output"""
    over_fitted: bool
    """whether the error of the validation rose by more than its spread over the flights explains"""
    failure: str
    """why the search found nothing; empty: it did"""
    units: tuple[str, ...] = ("rad",)
    """of the outputs, each once"""


def tune(
    tuning: Tuning, on_evaluation: OnEvaluation, should_stop: Callable[[], bool] = lambda: False
) -> Tuned:
    """Fit constants. The same tuning gives the same constants: all chance comes from its seed.

    The search ends early when `should_stop` says so; what it has found by then is judged and returned.

    Raises what is wrong with the configuration, the recording or the constants that the fit starts
    from; only what the search tries later is penalised instead.
    """
    config = tuning.config({})
    shared_parts(config)
    start = {name: present(config, name) for name in tuning.free}
    judge = Judge(tuning)
    before = judge(start, train=True)
    if before.lost == before.flights:
        raise StudyError(
            f"no flight with the constants as configured has figures, so there is nothing to start "
            f"from: {before.reason}"
        )
    before_test = judge(start, train=False)
    trials = Trials(
        lambda values: judge(values, train=True),
        tuning.evaluations,
        on_evaluation,
        before,
        start,
        PENALTY_RAD,
        should_stop,
    )
    trials.note(start, before)

    def error_at(shares: Iterable[float]) -> float:
        pairs = zip(tuning.free.items(), shares, strict=True)
        values = {name: one.at(min(max(float(share), 0.0), 1.0)) for (name, one), share in pairs}
        return trials.error_of(lambda: values)

    with suppress(Spent):
        _search(error_at, [_share(tuning.free[name], start[name]) for name in start], tuning)
    after_test = judge(trials.found, train=False)
    judged = {
        "train_before": before,
        "test_before": before_test,
        "train_after": trials.best,
        "test_after": after_test,
    }
    train_what, test_what = _described(config, tuning, judge)
    return Tuned(
        values=trials.found,
        **{name: one.rms_rad for name, one in judged.items()},
        evaluations=trials.count,
        penalised=trials.penalised,
        without_figures={name: one.lost for name, one in judged.items() if one.lost},
        train_what=train_what,
        test_what=test_what,
        test_each=after_test.each,
        test_largest=after_test.largest,
        test_amplitude=after_test.amplitude,
        over_fitted=is_worse(before_test, after_test),
        failure=_failure(trials) if trials.found == start else "",
        units=units_of(config),
    )


def _failure(trials: Trials[dict[str, float]]) -> str:
    """Return why nothing better than the start was found."""
    tried = trials.count - 1
    if tried and trials.penalised >= tried:
        return f"none of the {tried} parameter sets tried has figures: {trials.last_reason}"
    return f"none of the {tried} parameter sets tried is better than the one configured"


def _search(error_at: Callable[[Any], float], start: list[float], tuning: Tuning) -> None:
    """Search until nothing gets better; `error_at` ends it where enough has been flown."""
    if tuning.method == "nelder-mead":
        optimize: Any = import_module("scipy.optimize")
        options = {"maxfev": tuning.evaluations, "xatol": 1e-4, "fatol": 1e-7}
        bounds = [(0.0, 1.0)] * len(start)
        optimize.minimize(error_at, start, method="Nelder-Mead", bounds=bounds, options=options)
        return
    minimise(error_at, start, tuning.seed)


def _share(one: Range, value: float) -> float:
    """Return where a value lies in a range, 0 to 1; an end for one outside."""
    if one.scale == "log":
        if value <= 0.0:
            return 0.0
        share = math.log(value / one.first) / math.log(one.last / one.first)
    else:
        share = (value - one.first) / (one.last - one.first)
    return min(max(share, 0.0), 1.0)


def _described(config: FlightConfig, tuning: Tuning, judge: Judge) -> tuple[str, str]:
    split = tuning.split
    if not judge.recorded:
        return f"seeds {_listed(split.train_seeds)}", f"seeds {_listed(split.test_seeds)}"
    first, end, border, last = (
        tick * config.timing.tick_s for tick in (*judge.fit, judge.border, judge.ticks)
    )
    sizes = ", ".join(f"{scale:g}" for scale in tuning.augment.scales)
    shoves = " with and without shoves" if tuning.augment.shoves else ""
    return (
        f"{first:g} ... {end:g} s of the recording at the sizes {sizes}{shoves}",
        f"{border:g} ... {last:g} s of it, mean of all sample phases",
    )


def _listed(seeds: tuple[int, ...]) -> str:
    return f"{seeds[0]} ... {seeds[-1]}" if len(seeds) > 1 else str(seeds[0])


def units_of(config: FlightConfig) -> tuple[str, ...]:
    """Return the units of a model's outputs, each once."""
    return tuple(dict.fromkeys([one.unit for one in configured_signals(config).outputs]))


def shown(error: float, units: tuple[str, ...]) -> str:
    """Return an error with its unit, degrees for rad; with all of them where they differ."""
    if units == ("rad",):
        return f"{math.degrees(error):.4g} degrees"
    return f"{error:.4g} {' and '.join(units)}".rstrip()


def report(tuned: Tuned) -> Iterator[str]:
    """Yield lines with the errors of both parts, and the excluded flights."""
    for what, part in (
        (f"fit on {tuned.train_what}", "train"),
        (f"validated on {tuned.test_what}", "test"),
    ):
        before, after = (
            shown(getattr(tuned, f"{part}_{when}"), tuned.units) for when in ("before", "after")
        )
        yield f"{what}: rms error {before} -> {after}"
    least, worst = (shown(one, tuned.units) for one in (min(tuned.test_each), max(tuned.test_each)))
    largest = shown(tuned.test_largest, tuned.units[:1])
    penalty = f"{PENALTY_RAD:g} {' and '.join(tuned.units)}".rstrip()
    share = 100.0 * tuned.test_largest / tuned.test_amplitude
    yield (
        f"the {len(tuned.test_each)} flights of the validation: rms error {least} ... {worst}, "
        f"largest error {largest} ({share:.3g} % of the largest value)"
    )
    if tuned.failure:
        yield f"the fit failed: {tuned.failure}"
    elif tuned.over_fitted:
        yield "the fit does not hold on flights that it has not seen: it is over-fitted"
    for name, lost in tuned.without_figures.items():
        part, when = name.split("_")
        flights = "flights for the fit" if part == "train" else "flights for validation"
        yield f"{lost} of the {flights} failed {when} the fit and were scored {penalty} each"
    if tuned.penalised:
        yield (
            f"{tuned.penalised} of the {tuned.evaluations} parameter sets had failed flights, which "
            f"were scored {penalty} each"
        )


def preset_text(tuning: Tuning, tuned: Tuned) -> str:
    """Return a configuration file with the constants found, and how they were found.

    It has what decides how a coder does, and leaves out what it was flown on.
    """
    import tomli_w

    config = tuning.config(tuned.values)
    after = config.model_dump(mode="json", exclude_none=True)
    sections = {name: after[name] for name in ("timing", "channel", "model", "coder")}
    if BANDWIDTH in tuned.values:
        sections["transmitter"] = {BANDWIDTH.partition(".")[2]: tuned.values[BANDWIDTH]}
    file = [] if tuning.file is None else [f"--config {tuning.file}"]
    flown_with = [*file, *(f"{name}={value!r}" for name, value in flattened(tuning.overrides))]
    lines = [
        f"# Fitted by tenbaud tune: {tuning.method}, {tuned.evaluations} evaluations, "
        f"seed {tuning.seed}.",
        *(f"# {line}." for line in report(tuned)),
        "# Fitted: " + ", ".join(tuned.values) + ".",
        f"# Flown with: {', '.join(flown_with) or 'nothing changed'}.",
    ]
    head = {"preset": config.preset, "description": f"{config.description}; fitted".lstrip("; ")}
    return "\n".join(lines) + "\n" + tomli_w.dumps(head | sections)
