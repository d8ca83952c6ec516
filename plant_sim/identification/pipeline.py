"""From a record to parameters that can be trusted, or to the reasons why there are none.

The motor lag is found by the smallest simulation error; the regression (9), (10) then runs with it
over the whole record, and the simulation-error fit is the second opinion. Of the two, the one counts
that predicts better over every other segment, which the fit does without for that decision.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import TypeGuard

import numpy as np

from plant_sim.identification import simulation
from plant_sim.identification.errors import IdentificationError
from plant_sim.identification.estimator import CONDITION_MIN
from plant_sim.identification.faults import dominant_rad_s, require_motion
from plant_sim.identification.filters import Array
from plant_sim.identification.record import Record
from plant_sim.identification.regression import Filters, Regression, regress, require_bandwidth
from plant_sim.identification.segments import SAMPLES_MAX, SEGMENT_S, Segments, cut, every_other
from plant_sim.identification.simulation import SimulationFit
from plant_sim.identification.structures import (
    LinearStructure,
    Parameter,
    PitchStructure,
    Structure,
    gains_of,
    names_of,
)
from plant_sim.identification.trajectories import Candidate, simulation_residuals

LAGS_S = (0.0, 0.02, 0.05, 0.1, 0.2, 0.5)
UNCERTAINTY_MAX = 0.25
"""A standard error above this share of the estimate makes the estimate useless,"""
IMMATERIAL = 0.1
"""unless it moves the equation by less than this share."""
AGREEMENT = 0.1
FOLLOWED = 0.995
"""share of the motion that a fit should explain; below it shorter segments are tried"""
EXPLAINED = 0.9
"""share below which something else moves the plant"""
EXPLAINED_MIN = 0.5
"""share below which it moves the plant more than the inputs do"""
SHORTER = (1.0, 4.0, 16.0)
COARSE = 100
"""blocks of a regression of which only the last estimate counts"""


OF_A_LOG = Filters(forgetting_per_s=0.0, gain=None, rests=False)


@dataclass(frozen=True, slots=True)
class Options:
    """The options of an identification; None: found from the data."""

    lag_s: float | None = None
    bandwidth_rad_s: float | None = None
    filters: Filters = OF_A_LOG
    """the rest of their constants"""


@dataclass(frozen=True, slots=True, eq=False)
class Identification:
    """The result: two estimates, the chosen parameters, and notes about them."""

    structure: Structure
    regression: Regression
    check: SimulationFit | None
    lag_s: float
    lag_deviation_s: float
    values: dict[str, float]
    covariance: Array
    by_simulation: bool
    """whether the parameters are those of the simulation-error fit"""
    notes: tuple[str, ...]
    warnings: tuple[str, ...]
    refused: tuple[str, ...]
    """why the data support no model; empty when they do"""
    densities: tuple[float, ...] = ()
    """of each equation's white disturbance; empty: the regression's residual"""
    parameters: tuple[Parameter, ...] = field(init=False)

    def __post_init__(self) -> None:
        found = self.structure.parameters(self.values, self.covariance)
        object.__setattr__(self, "parameters", tuple(found))


def identify(record: Record, structure: Structure, options: Options | None = None) -> Identification:
    """Identify a structure; IdentificationError where a record cannot be used at all."""
    options = options or Options()
    require_motion(record)
    acting = structure.acting(record.inputs)
    still = np.ptp(acting, axis=0) == 0.0
    if np.any(still):
        what = record.input_names[int(np.argmax(still))]
        if isinstance(structure, PitchStructure):
            what = "voltage difference of the motors"
        raise IdentificationError(
            f"the {what} never changes, so its gain cannot be found: are these the right columns?"
        )
    notes: list[str] = []
    bandwidth = _bandwidth(record, structure, options, notes)
    filters = replace(options.filters, bandwidth_rad_s=bandwidth, lag_s=options.lag_s or 0.0)
    warnings: list[str] = []
    segments: Segments | None = None
    check: SimulationFit | None = None
    try:
        segments, check = _simulated(record, structure, filters, options)
        filters = replace(filters, lag_s=check.lag_s)
    except (IdentificationError, np.linalg.LinAlgError) as error:
        warnings.append(f"no cross-check: {error}")
    regression = regress(record, structure, filters)
    values, covariance, by_simulation = _decided(structure, regression, check, segments)
    if check is not None and segments is not None and _is_zero(structure, values, covariance):
        value, deviation = values["a_w"], math.sqrt(covariance[0, 0])
        notes.append(f"a_w = {value:.2g} +- {deviation:.2g} is 0 within its uncertainty: held at 0")
        structure = replace(structure, damped=False)
        start = {name: check.values[name] for name in names_of(structure)}
        fitted = simulation.fit(segments, structure, start, check.lag_s)
        check = replace(fitted, lag_deviation_s=check.lag_deviation_s)
        regression = regress(record, structure, filters)
        values, covariance, by_simulation = _decided(structure, regression, check, segments)
    if check is not None:
        warnings += disagreements(regression, check).values()
    deviation = 0.0 if check is None else check.lag_deviation_s
    result = Identification(
        structure,
        regression,
        check,
        filters.lag_s,
        deviation if filters.lag_s else 0.0,
        values,
        covariance,
        by_simulation,
        tuple(notes),
        (),
        (),
    )
    refused = tuple(_unsupported(result, record))
    return replace(result, warnings=(*warnings, *doubts(result)), refused=refused)


def _bandwidth(record: Record, structure: Structure, options: Options, notes: list[str]) -> float:
    """Return the pass band, near the frequency at which the outputs move."""
    found = dominant_rad_s(record, structure)
    usual = Filters().bandwidth_rad_s
    given = options.bandwidth_rad_s
    if given is None:
        # A slow input, such as steps, shows the plant's faster motion as well.
        fits = 0.1 <= found / usual <= 2.0
        share = 0.7 if found > usual else 3.0
        given = usual if fits else min(float(f"{share * found:.2g}"), 0.5 / record.step_s)
        if not fits:
            notes.append(f"the outputs move most at {found:.3g} rad/s: filters of {given:g} rad/s")
        return given
    require_bandwidth(given, record.step_s)
    if not 0.05 <= found / given <= 5.0:
        notes.append(
            f"the outputs move most at {found:.3g} rad/s, far from the filters' {given:g} rad/s: "
            f"--bandwidth {0.7 * found:.2g} suits them, or leave it out"
        )
    return given


def _rough_lag(
    record: Record, structure: Structure, filters: Filters, segments: Segments, options: Options
) -> float:
    """Return the lag with the smallest simulation error, of a few."""
    if options.lag_s is not None:
        return options.lag_s
    few = record.part(0.0, SAMPLES_MAX * record.step_s)
    candidates = []
    for lag_s in LAGS_S:
        values = regress(few, structure, replace(filters, lag_s=lag_s), blocks=COARSE).values
        candidates.append(Candidate(values, lag_s, segments))
    errors = _errors(structure, candidates)
    return candidates[errors.index(min(errors))].lag_s


def _errors(structure: Structure, candidates: list[Candidate]) -> list[float]:
    """Return the mean square of each candidate's simulation error, in usual motions."""
    residuals = simulation_residuals(structure, candidates)
    scales = [one.segments.scale for one in candidates]
    return [float(np.mean((one / scale) ** 2)) for one, scale in zip(residuals, scales, strict=True)]


def _simulated(
    record: Record, structure: Structure, filters: Filters, options: Options
) -> tuple[Segments, SimulationFit]:
    """Return the simulation-error fit with its lag, over segments that the model can follow."""
    best: tuple[Segments, SimulationFit] | None = None
    for shorter in SHORTER:
        length_s = SEGMENT_S / filters.bandwidth_rad_s / shorter
        if best is not None and length_s < 16.0 * record.step_s:
            break
        segments = cut(record, structure, length_s, rests=filters.rests)
        lag_s = _rough_lag(record, structure, filters, segments, options)
        start = regress(record, structure, replace(filters, lag_s=lag_s), blocks=COARSE)
        free = options.lag_s is None
        check = simulation.fit(segments, structure, start.values, lag_s, estimate_lag=free)
        if free and check.lag_s < max(0.25 * record.step_s, 2.0 * check.lag_deviation_s):
            check = simulation.fit(segments, structure, check.values, 0.0)
        if best is None or check.explained > best[1].explained:
            best = segments, check
        if check.explained > FOLLOWED:
            break
    assert best is not None
    return best


def _is_zero(
    structure: Structure, values: dict[str, float], covariance: Array
) -> TypeGuard[PitchStructure]:
    """Return whether a damping is negative, and 0 within its uncertainty."""
    if not isinstance(structure, PitchStructure) or values.get("a_w", 0.0) >= 0.0:
        return False
    stiffness = abs(structure.constants(values)[1])
    deviation = math.sqrt(max(0.0, covariance[0, 0]))
    return -values["a_w"] < max(3.0 * deviation, 0.02 * math.sqrt(stiffness))


def _decided(
    structure: Structure,
    regression: Regression,
    check: SimulationFit | None,
    segments: Segments | None,
) -> tuple[dict[str, float], Array, bool]:
    """Return the values that count, their covariance, and whether they are those of the fit."""
    if check is None or segments is None:
        return regression.values, regression.covariance, False
    if _predicts_better(structure, check, regression, segments):
        return check.values, check.covariance, True
    return regression.values, regression.covariance, False


def _predicts_better(
    structure: Structure, check: SimulationFit, regression: Regression, segments: Segments
) -> bool:
    """Return whether a fit of half the segments beats the regression over the other half."""
    if not np.all(np.isfinite(np.diag(regression.covariance))):
        return True
    used, held = (every_other(segments, first) for first in (0, 1))
    lag_s = regression.filters.lag_s
    fitted = simulation.fit(used, structure, check.values, lag_s)
    candidates = [Candidate(one.values, lag_s, held) for one in (fitted, regression)]
    ours, theirs = _errors(structure, candidates)
    return ours < theirs


def disagreements(regression: Regression, check: SimulationFit) -> dict[str, str]:
    """Return, by parameter, where the opinions differ more than both uncertainties and 10 % explain."""
    found = {}
    theirs = regression.structure.parameters(regression.values, regression.covariance)
    ours = regression.structure.parameters(check.values, check.covariance)
    for one, other in zip(theirs, ours, strict=True):
        spread = math.hypot(one.deviation, other.deviation)
        floor = 0.02 if one.letter == "theta_0" else 0.0
        small = one.letter == "a_w" and 0.02 * math.sqrt(abs(ours[1].value))
        if abs(one.value - other.value) > 3.0 * spread + AGREEMENT * abs(other.value) + floor + small:
            found[one.letter] = (
                f"{one.letter}: the regression says {one.value:.4g}, the simulation-error fit "
                f"{other.value:.4g}; the model does not describe these data well, or something else "
                "pushes the plant"
            )
    return found


def doubts(found: Identification) -> Iterable[str]:
    """Yield warnings about the parameters themselves."""
    structure = found.structure
    if isinstance(structure, PitchStructure) and found.values.get("k_v", 0.0) < 0.0:
        yield "k_v is negative: front and rear voltage are exchanged, or the encoder's sign"
    elif isinstance(structure, LinearStructure) and structure.kind in ("first-order", "integrator"):
        for name in gains_of(structure, len(structure.inputs)):
            if found.values.get(name, 0.0) < 0.0:
                yield f"{name} is negative: the sign of the input or of the encoder is turned (--sign)"
    if found.check is not None and found.check.explained < EXPLAINED:
        yield (
            f"the model explains {max(0.0, found.check.explained):.0%} of the motion between the "
            "recording's stretches; the rest are pushes that the file does not hold"
        )


def _unsupported(found: Identification, record: Record) -> Iterable[str]:
    """Yield why the data support no model, with the experiment that would."""
    regression, structure = found.regression, found.structure
    fastest, seen = dominant_rad_s(record, structure), 0.5 * math.pi / record.step_s
    if fastest > seen:
        yield (
            f"the outputs move most at {fastest:.3g} rad/s, and rows {record.step_s:g} s apart show "
            f"motion up to {seen:.3g} rad/s: the noise of a plant at rest, or sampled too slowly"
        )
    if regression.condition < CONDITION_MIN:
        levels = ", ".join(
            f"{term.name} {level:.2g}"
            for equation, one in zip(structure.equations, regression.estimates, strict=True)
            for term, level in zip(equation.terms, one.levels, strict=False)
        )
        yield (
            f"the data are not exciting enough to tell the parameters apart (measure "
            f"{regression.condition:.1e}, at least {CONDITION_MIN:g} is needed; root mean square of "
            f"the regressor of each: {levels})"
        )
    check = found.check
    if check is None:
        yield "no second method confirms the estimates: the simulation-error fit failed"
    elif check.explained < EXPLAINED_MIN:
        yield (
            f"the model explains {max(0.0, check.explained):.0%} of the motion, at least "
            f"{EXPLAINED_MIN:.0%} is needed: something that the file does not hold moves the plant "
            "more than its inputs do"
        )
    yield from uncertain(found, structure.acting(record.inputs[:1]).shape[1])
    if isinstance(structure, PitchStructure) and found.values.get("a_w", 0.0) < 0.0:
        yield (
            f"a_w = {found.values['a_w']:.4g} is negative: the data show a body that gains energy by "
            "itself; is the sign of the angle or of the voltages turned, or does the command act later "
            "than it is logged?"
        )


def uncertain(found: Identification, inputs: int) -> Iterable[str]:
    """Yield the parameters that are not known well enough for a model, where that matters."""
    structure, regression, check = found.structure, found.regression, found.check
    deviations = np.sqrt(np.maximum(np.diag(found.covariance), 0.0)).tolist()
    spread = dict(zip(found.values, deviations, strict=True))
    gains = gains_of(structure, inputs)
    differing = {} if check is None else disagreements(regression, check)
    for equation, one in zip(structure.equations, regression.estimates, strict=True):
        own = gains.intersection(term.name for term in equation.terms)
        sure = any(spread[name] <= UNCERTAINTY_MAX * abs(found.values[name]) for name in own)
        for term, level in zip(equation.terms, one.levels, strict=False):
            value, deviation = found.values[term.name], spread[term.name]
            small = deviation * level <= IMMATERIAL * one.target and (sure or term.name not in own)
            if check is not None and term.name in own.intersection(differing):
                apart = abs(regression.values[term.name] - check.values[term.name])
                if apart * level > IMMATERIAL * one.target:
                    yield differing[term.name]
            if not math.isfinite(deviation):
                yield f"{term.name}: the record is too short to say how sure the estimate is"
            elif deviation > UNCERTAINTY_MAX * abs(value) and not small:
                yield f"{term.name} = {value:.4g} is uncertain: its standard error is {deviation:.2g}"


def advice(record: Record, structure: Structure) -> str:
    """Return the experiment that would support a model."""
    slow = math.tau / dominant_rad_s(record, structure)
    less = f"integrator:{structure.order}"
    return (
        f"record at least {max(60.0, 20.0 * slow):.0f} s in which the input is moved on purpose, such "
        f"as a square wave of {2.0 * slow:.2g} s as large as the plant allows; or ask for less: "
        f"--structure {less if structure.kind != less else 'first-order'}"
    )
