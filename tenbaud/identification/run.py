"""One identification, from a record to a report and a configuration file."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from plant_sim.identification import pipeline, simulation
from plant_sim.identification.differences import Differences
from plant_sim.identification.errors import IdentificationError
from plant_sim.identification.faults import require_units
from plant_sim.identification.filters import Array
from plant_sim.identification.pipeline import Identification, Options
from plant_sim.identification.record import Record
from plant_sim.identification.regression import regress
from plant_sim.identification.segments import SEGMENT_S, cut
from plant_sim.identification.structures import PitchStructure, names_of
from plant_sim.identification.trajectories import Candidate, simulation_residuals
from tenbaud.identification.structure import Chosen, choose
from tenbaud.log.angles import turn_of, unwrapped

DRIFT_EXPLAINED = 0.98
UNIT_SCALES = {
    0.017453292519943295: "the angle is in degrees and is read as rad, a factor of 57.3",
    57.29577951308232: "the angle is in rad and is read as degrees, a factor of 57.3",
    0.001: "the angle is in mrad and is read as rad, a factor of 1000",
}


@dataclass(frozen=True, slots=True, eq=False)
class Wanted:
    """The options of an identification."""

    structure: str = ""
    equilibrium: str = "auto"
    volts_max: float = float("inf")
    pitches: bool = True
    """the signals are those of a pitch model"""
    units_given: bool = False
    options: Options = field(default_factory=Options)


@dataclass(frozen=True, slots=True, eq=False)
class Identified:
    """The result for one record."""

    name: str
    record: Record
    found: Identification
    chosen: Chosen
    notes: tuple[str, ...]
    warnings: tuple[str, ...]
    advice: str
    """the experiment that would support a model; empty where this one does"""

    @property
    def supported(self) -> bool:
        """Return whether there is a model to write."""
        return not self.found.refused


def run(name: str, record: Record, wanted: Wanted) -> Identified:
    """Identify one record; IdentificationError where it cannot be used at all."""
    warnings = require_units(record)
    if warnings and not wanted.units_given:
        raise IdentificationError(warnings[0])
    record, notes = _unwrapped(record)
    chosen = choose(
        record,
        wanted.structure,
        wanted.equilibrium,
        pitches=wanted.pitches,
        volts_max=wanted.volts_max,
    )
    found = pipeline.identify(record, chosen.structure, wanted.options)
    if isinstance(chosen.structure, PitchStructure):
        _require_angle(record, chosen.structure, found)
        record, found = _without_drift(record, chosen.structure, found, wanted, warnings)
        warnings += _saturated(record, chosen.structure)
        turns = float(np.ptp(record.outputs[:, 0])) / (2.0 * np.pi)
        if turns > 1.0:
            warnings.append(
                f"the angle turns {turns:.1f} times: right for a pendulum or a motor, else the column "
                "is in other units"
            )
    advice = pipeline.advice(record, chosen.structure) if found.refused else ""
    return Identified(
        name,
        record,
        found,
        chosen,
        (*notes, *found.notes),
        (*warnings, *found.warnings),
        advice,
    )


def _unwrapped(record: Record) -> tuple[Record, list[str]]:
    """Return a record whose angles do not jump by a turn, and the changes."""
    outputs, notes = record.outputs.copy(), []
    for index, (name, unit) in enumerate(zip(record.output_names, record.output_units, strict=True)):
        turn = turn_of(unit, None)
        whole = unwrapped(outputs[:, index], turn) if turn else None
        if whole is not None and whole.rows:
            outputs[:, index] = whole.values
            notes.append(f"{name}: unwrapped at {len(whole.rows)} jump(s) of a turn")
    return replace(record, outputs=outputs), notes


def _saturated(record: Record, structure: PitchStructure) -> list[str]:
    beyond = float(np.mean(np.any(np.abs(record.inputs) > structure.volts_max, axis=1)))
    if beyond <= 0.02:
        return []
    return [
        f"the motors were commanded beyond +-{structure.volts_max:g} V in {beyond:.0%} of the samples; "
        "the voltages were clamped there, as the motors do: if they saturate elsewhere, set "
        "limits.command_max, or the gain k_v comes out wrong"
    ]


def _require_angle(record: Record, structure: PitchStructure, found: Identification) -> None:
    """Raise IdentificationError where the sine fits an angle in another unit far better."""
    if found.check is None or found.check.explained > 0.9:
        return
    for scale, text in UNIT_SCALES.items():
        explained = _explained(replace(record, outputs=scale * record.outputs), found)
        # What is left must be far less: a small angle is explained by anything.
        if 1.0 - explained < 0.1 * (1.0 - found.check.explained):
            raise IdentificationError(
                f"{text}: so read, the model explains {explained:.1%} of the motion instead of "
                f"{max(0.0, found.check.explained):.1%}. Give --units"
            )


def _explained(record: Record, found: Identification) -> float:
    """Return the share of the motion that a fit of the same structure explains, theta_0 free."""
    structure = PitchStructure(None, getattr(found.structure, "volts_max", float("inf")))
    filters = replace(found.regression.filters, rests=False, gain=None)
    segments = cut(record, structure, SEGMENT_S / filters.bandwidth_rad_s)
    start = regress(record, structure, filters, blocks=pipeline.COARSE).values
    try:
        return simulation.fit(segments, structure, start, filters.lag_s).explained
    except (IdentificationError, np.linalg.LinAlgError):
        return 0.0


def _without_drift(
    record: Record,
    structure: PitchStructure,
    found: Identification,
    wanted: Wanted,
    warnings: list[str],
) -> tuple[Record, Identification]:
    """Return the record and its identification, without a steady drift where that explains it."""
    turned = float(np.ptp(record.outputs[:, 0])) > 2.0 * np.pi
    if not turned or found.check is None or found.check.explained > DRIFT_EXPLAINED:
        return record, found
    times = (np.arange(len(record)) * record.step_s).astype(np.float64)

    # A drift and a lag stand in for each other: both are fitted with the parameters.
    free = PitchStructure(None, structure.volts_max)
    length_s = SEGMENT_S / found.regression.filters.bandwidth_rad_s
    segments = cut(record, free, length_s)
    clock = cut(replace(record, outputs=times[:, None]), free, length_s).outputs
    guess = float(np.polyfit(times, record.outputs[:, 0], 1)[0])
    lag_s, names = wanted.options.lag_s, names_of(free)
    filters = replace(found.regression.filters, lag_s=0.05 if lag_s is None else lag_s)

    def without(rate: float) -> Record:
        return replace(record, outputs=record.outputs - rate * times[:, None])

    def candidate(values: Array) -> Candidate:
        *found, lag, rate = values.tolist()
        straight = replace(segments, outputs=segments.outputs - rate * clock)
        named, lag = dict(zip(names, found, strict=True)), abs(lag) if lag_s is None else lag_s
        return Candidate(named, lag, straight)

    def residuals_of(sets: list[Array]) -> list[Array]:
        return [one.ravel() for one in simulation_residuals(free, [candidate(one) for one in sets])]

    start = regress(without(guess), free, filters, blocks=pipeline.COARSE).values
    residuals, first = Differences(residuals_of), [*start.values(), filters.lag_s, guess]
    rate = float(least_squares(residuals, first, residuals.jacobian, max_nfev=20).x[-1])
    straight = without(rate)
    again = pipeline.identify(straight, structure, wanted.options)
    if again.check is None or again.check.explained < DRIFT_EXPLAINED:
        return record, found
    warnings.append(
        f"the angle drifts by {rate:.3g} rad/s all the time, as an encoder that slips or an "
        "integrated gyro does: the drift was taken off before the identification; look at the sensor"
    )
    return straight, again


def model_section(found: Identification) -> dict[str, Any]:
    """Return the section [model] of a pitch model that both ends would fly with."""
    fields = {one.name: round(one.value, 6) for one in found.parameters}
    return {"kind": "pitch", **fields, "motor_lag_s": round(found.lag_s, 6)}
