"""A record of a model's signals, and the structure to identify: the requested or a suitable one."""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress
from typing import NamedTuple

from channel.codec.signals import Signals
from plant_sim.identification.errors import IdentificationError
from plant_sim.identification.filters import Array
from plant_sim.identification.pitch import quiescent_angle
from plant_sim.identification.record import Record
from plant_sim.identification.structures import PitchStructure, Structure, parse_linear

SPEEDS = ("speed", "omega", "velocity", "rpm", "rate", "drehzahl")
"""words of an output's name that say that it has no rate"""


def record_of(
    step_s: float, outputs: Array, inputs: Array, signals: Signals, steps: Sequence[float]
) -> Record:
    """Return a record of these signals, as many inputs as there are columns; `steps` of the outputs."""
    acting = signals.inputs[: inputs.shape[1]]
    return Record(
        step_s,
        outputs,
        inputs,
        tuple([one.name for one in signals.outputs]),
        tuple([one.name for one in acting]),
        tuple([one.unit for one in signals.outputs]),
        tuple([one.unit for one in acting]),
        tuple(steps),
    )


class Chosen(NamedTuple):
    """A structure, and how it came about."""

    structure: Structure
    why: str
    equilibrium: str
    """where theta_0 comes from; empty for a structure that has none"""


def choose(
    record: Record,
    wanted: str,
    equilibrium: str,
    *,
    pitches: bool,
    volts_max: float = math.inf,
) -> Chosen:
    """Return the structure. `pitches`: the signals are those of a pitch model.

    `equilibrium` is "quiet", "estimate", "auto" or a number in rad.
    """
    why = "as asked"
    if not wanted:
        wanted, why = _suiting(record, pitches)
    if wanted != "pitch":
        if equilibrium not in ("auto", "estimate"):
            raise IdentificationError(f"--equilibrium is of the structure pitch, and this is {wanted}")
        return Chosen(parse_linear(wanted, record.output_names, record.input_names), why, "")
    if record.outputs.shape[1] != 1 or not 1 <= record.inputs.shape[1] <= 2:
        raise IdentificationError(
            f"--structure pitch has one angle and one or two voltages; the record has the outputs "
            f"{', '.join(record.output_names)} and the inputs {', '.join(record.input_names) or 'none'}"
        )
    angle, source = _equilibrium(record, equilibrium)
    return Chosen(PitchStructure(angle, volts_max), why, source)


def _suiting(record: Record, pitches: bool) -> tuple[str, str]:
    if pitches:
        return "pitch", "the model is that of a pitch axis"
    if record.outputs.shape[1] > 1:
        return "linear", f"there are {record.outputs.shape[1]} outputs, which may be coupled"
    name, unit = record.output_names[0], record.output_units[0]
    if unit.endswith(("/s", "rpm", "/min")) or any(word in name.lower() for word in SPEEDS):
        return "first-order", f"{name} is a speed"
    return "siso:2,0", f"{name} is no speed, so it has a rate"


def _equilibrium(record: Record, wanted: str) -> tuple[float | None, str]:
    if wanted == "estimate":
        return None, "estimated with the other parameters"
    if wanted in ("auto", "quiet"):
        quiet = quiescent_angle(record) if record.output_units[0] in ("rad", "") else None
        if quiet is not None:
            span = f"{quiet.start_s:.1f} to {quiet.end_s:.1f} s"
            return quiet.angle_rad, f"rest with equal voltages, {span}"
        if wanted == "quiet":
            raise IdentificationError(
                "the record has no stretch in which the body rests and both motors pull equally; "
                "give --equilibrium in rad, or estimate"
            )
        return None, "estimated with the other parameters: the record has no quiet stretch"
    with suppress(ValueError):
        if math.isfinite(angle := float(wanted)):
            return angle, "given"
    raise IdentificationError(f"--equilibrium {wanted}: give auto, quiet, estimate or an angle in rad")
