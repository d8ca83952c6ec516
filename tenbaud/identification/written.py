"""The configuration of an identified plant: all that a flight of it needs."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from plant_sim.identification.filters import low_pass
from plant_sim.identification.record import Record
from plant_sim.identification.structures import LinearStructure, StateSpace
from tenbaud.config.load import OWN, load_config, merged, merged_values, toml_text
from tenbaud.config.schema import FlightConfig
from tenbaud.design.complete import completed
from tenbaud.design.settings import settings_of
from tenbaud.design.systems import Matrices, Names
from tenbaud.files.whole import whole_file, write_whole
from tenbaud.identification.run import Identified, model_section
from tenbaud.identification.sources import Source
from tenbaud.log.units import turn_in

WHOLE = 1e-6
DENSITY_LEAST = 1e-3
"""smallest assumed disturbance, as a share of the inputs' effect"""
SLEW_USUAL = 1000.0
TICK_S_MAX = 1.0
PIECE = 100_000
"""rows that are written at once"""


def settings(
    config: FlightConfig, one: Identified, source: Source, given: Collection[str]
) -> dict[str, Any]:
    """Return nested settings; those whose full names are in `given` stay, and all of an excited rig.

    Empty where the rows lie further apart than ticks can.
    """
    record = one.record
    if record.step_s > TICK_S_MAX:
        return {}
    tick_s = float(f"{record.step_s:.9g}")
    ticks = max(1, math.ceil(config.timing.symbol_period_s / tick_s - WHOLE))
    limits = config.limits.model_dump(mode="json", exclude_unset=True, exclude_none=True)
    if not source.excited:
        kept = {name: limits[name] for name in limits if f"limits.{name}" in given}
        limits = _limits(record) | kept
    section = config.transmitter.encoders
    if source.excited or any(name.startswith("transmitter.encoders.") for name in given):
        encoders = section.model_dump(mode="json", exclude_unset=True, exclude_none=True)
    else:
        encoders = _encoders(record)
    values: dict[str, Any] = {
        "duration_s": float(f"{len(record) * tick_s:.9g}"),
        "timing": {"tick_s": tick_s, "symbol_period_s": float(f"{ticks * tick_s:.9g}")},
        "channel": {"rate_baud": config.channel.rate_baud},
        "limits": limits,
        "transmitter": {"encoders": encoders},
    }
    if source.file is not None:
        log = config.flight_log.model_dump(mode="json", exclude_defaults=True, exclude_none=True)
        for table in (one for one in log.values() if isinstance(one, dict)):
            for name in source.dropped:
                table.pop(name, None)
                table.pop(f"in:{name}", None)
        values["flight_log"] = {**log, "file": str(source.file.resolve())}
    if isinstance(one.found.structure, LinearStructure):
        return _linear(one, values)
    if source.bits is not None:
        values["coder"] = config.coder.model_dump(mode="json", exclude_unset=True, exclude_none=True)
    # What the plant of a simulated flight is like is not known better than its model.
    return {"preset": config.preset, **values, "model": model_section(one.found)}


def _limits(record: Record) -> dict[str, Any]:
    """Return the limits that the file's own commands show."""
    largest = np.abs(record.inputs).max(axis=0)
    largest = np.where(largest > 0.0, largest, max(float(largest.max()), 1e-3))
    slew = np.abs(np.diff(record.inputs, axis=0)).max(axis=0) / record.step_s
    return {
        "command_max": [_rounded_up(value) for value in largest.tolist()],
        "command_slew_per_s": [max(SLEW_USUAL, _rounded_up(1.01 * value)) for value in slew.tolist()],
    }


def _rounded_up(value: float) -> float:
    place = 10.0 ** (math.floor(math.log10(value)) - 2) if value > 0.0 else 1.0
    return float(f"{math.ceil(value / place - WHOLE) * place:.6g}")


def _encoders(record: Record) -> dict[str, Any]:
    """Return the encoders whose steps the file shows."""
    found: dict[str, Any] = {}
    for name, unit, step in zip(record.output_names, record.output_units, record.steps, strict=True):
        turn = turn_in(unit)
        if step and turn is None:
            found[name] = {"counts_per_unit": 1.0 / step}
        elif step and turn is not None and 2 <= round(turn / step) <= 10_000_000:
            found[name] = {"counts_per_turn": round(turn / step)}
        else:
            found[name] = {"quantised": False}
    return found


def _linear(one: Identified, values: dict[str, Any]) -> dict[str, Any]:
    """Return the settings of a flight of a linear model, its codec designed."""
    structure, record = one.found.structure, one.record
    assert isinstance(structure, LinearStructure)
    space = structure.state_space(one.found.values)
    size, inputs = space.B.shape
    rest = np.linalg.lstsq(np.hstack((space.A, space.B)), -space.offset, rcond=None)[0]
    rest = np.asarray(rest, dtype=np.float64)
    x0, u0 = rest[:size], rest[size:]
    A, B, C = space.A, space.B, space.C
    states = space.states
    if one.found.lag_s > 0.0:
        rate = np.eye(inputs) / one.found.lag_s
        A = np.block([[space.A, space.B], [np.zeros((inputs, size)), -rate]])
        B = np.vstack((np.zeros((size, inputs)), rate))
        C = np.hstack((space.C, np.zeros((len(space.C), inputs))))
        x0 = np.concatenate((x0, u0))
        states = (*states, *(f"{name}_lagging" for name in record.input_names))
    last = np.arange(1, len(space.C) + 1) * structure.n - 1
    model = {
        "G": np.eye(len(A))[:, last].tolist(),
        "densities": _densities(one, space, values["timing"]["symbol_period_s"]),
        "states": list(states),
        "inputs": list(record.input_names),
        "outputs": list(record.output_names),
        "input_units": list(record.input_units),
        "output_units": list(record.output_units),
        "corrected": size if one.found.lag_s > 0.0 else 0,
    }
    over = {**values, "model": model}
    names = Names(tuple(states), record.input_names, record.output_names)
    plant = Matrices(A, B, C, 0.0, names, np.array(x0, float), np.array(u0, float), linear=True)
    own = merged(settings_of(plant, None, over), over)
    own["model"].pop("state_units", None)
    density = ":".join(f"{value:g}" for value in own["model"]["densities"])
    own["transmitter"]["plant"] = {"disturbance": f"q={density}"}
    whole = completed(merged_values(OWN, None, own))
    return {**own, "preset": OWN, "model": whole["model"], "coder": whole["coder"]}


def _densities(one: Identified, space: StateSpace, period_s: float) -> list[float]:
    """Return q of each equation's disturbance: as found, or the residual of the regression."""
    filters = one.found.regression.filters
    polynomial = low_pass(one.found.structure.order, filters.bandwidth_rad_s, filters.damping)
    # The filter's noise bandwidth: integral of |H|^2 over all frequencies in Hz.
    omega = np.concatenate((-np.geomspace(1e4, 1e-4, 4000), np.geomspace(1e-4, 1e4, 4000)))
    omega = omega * filters.bandwidth_rad_s
    response = polynomial[-1] / np.polyval(polynomial, 1j * omega)
    width = float(np.trapezoid(np.abs(response) ** 2, omega) / math.tau)
    largest = np.abs(one.record.inputs).max(axis=0)
    found = []
    densities = one.found.densities or [
        estimate.residual**2 / width for estimate in one.found.regression.estimates
    ]
    for index, density in enumerate(densities):
        pushed = float(np.abs(space.B[(index + 1) * one.found.structure.order - 1]) @ largest)
        least = (DENSITY_LEAST * max(pushed, 1e-9)) ** 2 * period_s
        found.append(float(f"{max(density, least):.3g}"))
    return found


def write(path: Path, values: Mapping[str, Any], one: Identified, said: str = "") -> None:
    """Write settings that `demo`, `transmit`, `receive` and `tune` take."""
    load_config(values["preset"], None, dict(values))
    found = one.found
    head = [f"# Identified from {one.name}: structure {found.structure.kind}, {one.chosen.why}."]
    head += [
        f"# {item.letter} = {item.value:.5g} +- {item.deviation:.2g} {item.unit} (standard error)"
        for item in found.parameters
    ]
    head.append(f"# motor lag {found.lag_s:.4g} +- {found.lag_deviation_s:.2g} s")
    if one.chosen.equilibrium:
        head.append(f"# theta_0: {one.chosen.equilibrium}")
    head += [f"# Note: {text}" for text in one.notes]
    head += [f"# Warning: {text}" for text in one.warnings]
    head += [f"# {said}"] * bool(said)
    write_whole(path, "\n".join(head) + "\n" + toml_text(merged({}, dict(values))))


def write_record(path: Path, record: Record) -> dict[str, Any]:
    """Write a record as a log, and return the section that reads it."""
    names = ["time", *record.output_names, *record.input_names]
    with whole_file(path) as stream:
        stream.write(f"{','.join(names)}\n".encode())
        for first in range(0, len(record), PIECE):
            piece = slice(first, first + PIECE)
            outputs, inputs = record.outputs[piece], record.inputs[piece]
            times = (first + np.arange(len(outputs))) * record.step_s
            np.savetxt(stream, np.column_stack((times, outputs, inputs)), "%.9g", ",")
    roles = [f"out:{name}" for name in record.output_names]
    roles += [f"in:{name}" for name in record.input_names]
    units = zip(roles, (*record.output_units, *record.input_units), strict=True)
    return {
        "file": str(path.resolve()),
        "columns": {"time": "time", **dict(zip(roles, names[1:], strict=True))},
        "units": {"time": "s", **{role: unit for role, unit in units if unit}},
    }
