"""Fitting constants of a coder, and if asked of the model, on flights; judged on flights it never saw.

On simulated flights, one set of seeds is for the fit and another for the judgement. On a recorded
flight, the first part is for the fit and the rest for the judgement; there the codec flies through the
whole recording and only the rest counts. The measure is the rms error of what the receiver believed.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np

from channel.errors import TenbaudError
from plant_sim.encoder import angle_of
from tenbaud.config.load import load_config
from tenbaud.config.schema import FlightConfig
from tenbaud.studies.figures import FlightFigures
from tenbaud.studies.flights import CompiledPoint, recorded_flight
from tenbaud.studies.plain import fly_plain
from tenbaud.studies.schedule import Uncommon
from tenbaud.studies.settings import StudyError, check_name, configured
from tenbaud.studies.side_by_side import fly_seeds
from tenbaud.studies.study import Range

Method = Literal["differential-evolution", "nelder-mead"]

PENALTY_RAD = 100.0
"""What a flight without figures counts as: worse than any error that an angle can have."""

POPULATION = 8
"""Candidates per constant in differential evolution."""

CODER_RANGES = {
    "zoom": {
        "coder.minimum_range_rad": (0.1, 10.0, "log"),
        "coder.decay": (0.6, 0.99, "linear"),
        "coder.gains.0": (0.2, 3.0, "log"),
        "coder.gains.1": (0.2, 3.0, "log"),
    },
    "fixed": {
        "coder.range_rad": (0.1, 10.0, "log"),
        "coder.gains.0": (0.2, 3.0, "log"),
        "coder.gains.1": (0.2, 3.0, "log"),
    },
    "timed": {
        "coder.minimum_range_rad": (0.1, 10.0, "log"),
        "coder.gains.0": (0.2, 3.0, "log"),
        "coder.gains.1": (0.2, 3.0, "log"),
    },
    "history": {
        "coder.minimum_range_rad": (0.2, 5.0, "log"),
        "coder.weights.0": (0.5, 2.0, "log"),
        "coder.weights.2": (0.5, 2.0, "log"),
    },
    "static": {"coder.gains.0": (0.1, 5.0, "log"), "coder.gains.1": (0.1, 5.0, "log")},
}
"""Constants that are fitted unless others are named; log: the ends are multiples of what is set."""

MODEL_FACTORS = (
    "model.rate_damping_per_s",
    "model.stiffness_per_s2",
    "model.torque_gain_rad_per_v_s2",
    "model.motor_lag_s",
)


class Split(NamedTuple):
    """Which flights are for the fit, and which for the judgement."""

    train_seeds: tuple[int, ...]
    test_seeds: tuple[int, ...]
    train_share: float
    """of a recorded flight"""


class Tuned(NamedTuple):
    """What came of it. Errors are rms of the live estimate, in rad."""

    values: dict[str, float]
    train_before: float
    test_before: float
    train_after: float
    test_after: float
    evaluations: int
    train_what: str
    test_what: str


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
    seed: int = 1

    def config(self, values: dict[str, float], **changes: Any) -> FlightConfig:
        """Return the configuration with these constants; ConfigError where there is none."""
        fixed = {**self.overrides, **changes}
        return configured(self.preset, self.file, fixed, dict(values))


def free_ranges(config: FlightConfig, names: dict[str, Range], *, model: bool) -> dict[str, Range]:
    """Return the constants to fit: those named, or the usual ones of the coder, and of the model.

    StudyError for names that do not exist and for a coder without usual ones.
    """
    for name in names:
        check_name(name)
    free = dict(names)
    if not free:
        usual = CODER_RANGES.get(config.coder.kind)
        if usual is None:
            raise StudyError(
                f"the coder {config.coder.kind!r} has no usual constants: name some with --free"
            )
        free = {name: _usual(config, name, *spread) for name, spread in usual.items()}
    if model:
        if config.model.kind != "pitch":
            raise StudyError(f"the model {config.model.kind!r} has no constants to fit")
        free |= {name: _usual(config, name, 0.5, 2.0, "log") for name in MODEL_FACTORS}
        free["model.equilibrium_rad"] = Range.model_validate({"from": -0.4, "to": 0.4})
    return free


def _usual(config: FlightConfig, name: str, low: float, high: float, scale: str) -> Range:
    factor = abs(present(config, name)) if scale == "log" else 1.0
    return Range.model_validate({"from": low * factor, "to": high * factor, "scale": scale})


def present(config: FlightConfig, name: str) -> float:
    """Return what a constant is now."""
    here: Any = config
    for part in name.split("."):
        here = here[int(part)] if part.isdigit() else getattr(here, part, None)
        if here is None:
            raise StudyError(f"{name} is not a constant of the coder and model that are configured")
    if isinstance(here, bool) or not isinstance(here, int | float):
        raise StudyError(f"{name} is no number, so it cannot be fitted")
    return float(here)


def tune(tuning: Tuning, on_evaluation: Callable[[int, float], None]) -> Tuned:
    """Fit; `on_evaluation` is told the number of evaluations and the smallest error so far, in rad.

    The same tuning gives the same constants: all chance comes from its seed.
    """
    names = list(tuning.free)
    config = tuning.config({})
    start = {name: present(config, name) for name in names}
    best: dict[str, Any] = {"error": math.inf, "values": start, "count": 0}

    def error_at(shares: Iterable[float]) -> float:
        values = {
            name: tuning.free[name].at(min(max(float(share), 0.0), 1.0))
            for name, share in zip(names, shares, strict=True)
        }
        error = train_error(tuning, values)
        best["count"] += 1
        if error < best["error"]:
            best["error"], best["values"] = error, values
        on_evaluation(best["count"], best["error"])
        return error

    before = train_error(tuning, start)
    _search(error_at, [_share(tuning.free[name], start[name]) for name in names], tuning)
    if before <= best["error"]:
        best["values"] = start
    values = best["values"]
    recorded = config.transmitter.rig == "replay"
    train_what, test_what = _described(tuning.split, recorded)
    return Tuned(
        values,
        before,
        test_error(tuning, start),
        train_error(tuning, values),
        test_error(tuning, values),
        best["count"],
        train_what,
        test_what,
    )


def _search(error_at: Callable[[Any], float], start: list[float], tuning: Tuning) -> None:
    optimize: Any = import_module("scipy.optimize")
    size = len(start)
    if tuning.method == "nelder-mead":
        options = {"maxfev": tuning.evaluations, "xatol": 1e-4, "fatol": 1e-7}
        optimize.minimize(
            error_at, start, method="Nelder-Mead", bounds=[(0.0, 1.0)] * size, options=options
        )
        return
    rounds = max(1, tuning.evaluations // (POPULATION * size) - 1)
    optimize.differential_evolution(
        error_at,
        [(0.0, 1.0)] * size,
        x0=start,
        rng=np.random.default_rng(tuning.seed),
        popsize=POPULATION,
        maxiter=rounds,
        polish=False,
        tol=0.0,
    )


def _share(one: Range, value: float) -> float:
    """Return where a value lies in a range, 0 to 1; an end for one outside."""
    if one.scale == "log":
        if value <= 0.0:
            return 0.0
        share = math.log(value / one.first) / math.log(one.last / one.first)
    else:
        share = (value - one.first) / (one.last - one.first)
    return min(max(share, 0.0), 1.0)


def train_error(tuning: Tuning, values: dict[str, float]) -> float:
    """Return the error on the flights for the fit."""
    return _error(tuning, values, train=True)


def test_error(tuning: Tuning, values: dict[str, float]) -> float:
    """Return the error on the flights for the judgement."""
    return _error(tuning, values, train=False)


test_error.__test__ = False  # type: ignore[attr-defined]


def _error(tuning: Tuning, values: dict[str, float], *, train: bool) -> float:
    try:
        config = tuning.config(values)
        if config.transmitter.rig == "replay":
            return _recorded_error(config, tuning.split.train_share, train=train)
    except (Uncommon, TenbaudError):
        return PENALTY_RAD
    seeds = tuning.split.train_seeds if train else tuning.split.test_seeds
    squares = 0.0
    try:
        flown = fly_seeds(CompiledPoint(config), seeds)
    except Uncommon:
        flown = [None] * len(seeds)
    for seed, figures in zip(seeds, flown, strict=True):
        rms = _simulated_rms(config, figures, seed)
        squares += min(rms * rms, PENALTY_RAD * PENALTY_RAD) if math.isfinite(rms) else PENALTY_RAD**2
    return math.sqrt(squares / len(seeds))


def _simulated_rms(config: FlightConfig, figures: FlightFigures | None, seed: int) -> float:
    if figures is None:
        figures = fly_plain(config.model_copy(update={"seed": seed}))
    return figures.error_live_rms if figures.outcome == "ok" else math.inf


def _recorded_error(config: FlightConfig, share: float, *, train: bool) -> float:
    """Return the rms error over the first part of a recording, or over the rest."""
    log = recorded_flight(config)
    border = math.floor(share * len(log))
    if train:
        config = config.model_copy(update={"duration_s": border * config.timing.tick_s})
    point = CompiledPoint(config)
    _, trace = point.fly(config.seed)
    numbers = point.numbers
    first, last = (0, min(border, numbers.ticks)) if train else (border, numbers.ticks)
    first = max(first, numbers.lead)
    if last <= first:
        raise StudyError("the recording is too short for such a split")
    place = (numbers.counts_per_turn, numbers.sign, numbers.zero_counts)
    angles = np.array([angle_of(row[0], *place) for row in log.counts[first:last]])
    return float(np.sqrt(np.mean((angles - trace.live[first:last]) ** 2)))


def _described(split: Split, recorded: bool) -> tuple[str, str]:
    if recorded:
        percent = 100.0 * split.train_share
        return f"first {percent:g} % of the recording", f"last {100.0 - percent:g} % of it"
    return f"seeds {_listed(split.train_seeds)}", f"seeds {_listed(split.test_seeds)}"


def _listed(seeds: tuple[int, ...]) -> str:
    return f"{seeds[0]} ... {seeds[-1]}" if len(seeds) > 1 else str(seeds[0])


def preset_text(tuning: Tuning, tuned: Tuned) -> str:
    """Return a configuration file with the constants found, and how they were found."""
    import tomli_w

    config = tuning.config(tuned.values)
    base = load_config(tuning.preset, tuning.file, tuning.overrides)
    after, before = config.model_dump(mode="json"), base.model_dump(mode="json")
    sections = {name: after[name] for name in ("timing", "channel", "model", "coder")}
    degrees = [
        math.degrees(value)
        for value in (tuned.train_before, tuned.train_after, tuned.test_before, tuned.test_after)
    ]
    lines = [
        f"# Fitted by tenbaud tune: {tuning.method}, {tuned.evaluations} evaluations, "
        f"seed {tuning.seed}.",
        f"# Fit on {tuned.train_what}: rms error {degrees[0]:.4g} -> {degrees[1]:.4g} degrees.",
        f"# Judged on {tuned.test_what}: {degrees[2]:.4g} -> {degrees[3]:.4g} degrees.",
        "# Fitted: " + ", ".join(tuned.values) + ".",
    ]
    head = {"preset": config.preset, "description": f"{before['description']}; fitted"}
    return "\n".join(lines) + "\n" + tomli_w.dumps(head | sections)
