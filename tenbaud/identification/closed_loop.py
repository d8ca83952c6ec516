"""Results of a record without the plant's inputs: its motion, and a closed loop's bandwidth."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import numpy as np
from scipy.signal import savgol_filter

from plant_sim.identification.errors import IdentificationError
from plant_sim.identification.faults import dominant_rad_s
from plant_sim.identification.pipeline import identify
from plant_sim.identification.record import Record
from plant_sim.identification.structures import LinearStructure

SET_POINTS = {"setpoint", "reference", "ref", "desired", "target", "soll"}
COMMANDS = {"u", "v", "i", "voltage", "current", "torque", "pwm"}
"""Words of a name that mark a controller's command: `i_ref` moves the plant."""


def _set_points(record: Record) -> list[int]:
    """Return the inputs whose names say that they are set-points, in the unit of an output."""
    found = []
    for index, (name, unit) in enumerate(zip(record.input_names, record.input_units, strict=True)):
        words = set(re.findall("[a-z]+", re.sub("set[ _-]point", "setpoint", name.lower())))
        if words & SET_POINTS and not words & COMMANDS and unit in ("", *record.output_units):
            found.append(index)
    return found


def with_commands(record: Record) -> tuple[Record, tuple[str, ...]]:
    """Return a record without the set-points beside its commands, and their names.

    Raises IdentificationError, with what the record does say, where no command is in it.
    """
    wanted = _set_points(record)
    if record.inputs.shape[1] > len(wanted):
        kept = [index for index in range(record.inputs.shape[1]) if index not in wanted]
        commands = replace(
            record,
            inputs=record.inputs[:, kept],
            input_names=tuple([record.input_names[index] for index in kept]),
            input_units=tuple([record.input_units[index] for index in kept]),
        )
        return commands, tuple([record.input_names[index] for index in wanted])
    lines = [_motion(record, index) for index in range(record.outputs.shape[1])]
    lines += [_loop(record, index) for index in wanted]
    missing = (
        "a set-point was logged, not the controller's command" if wanted else "no input was logged"
    )
    raise IdentificationError(
        "\n  ".join(
            [
                f"{missing}: no model of the plant follows, as any plant under its own controller "
                "moves alike. The record says:",
                *lines,
                "log the voltages (or currents, torques) beside the outputs, and name them with "
                "--columns; without them it can still be flown: tenbaud demo --rig replay:FILE",
            ]
        )
    )


def _motion(record: Record, index: int) -> str:
    one = Record(record.step_s, record.outputs[:, index : index + 1], record.inputs[:, :0])
    values, unit = one.outputs[:, 0], record.output_units[index]
    window = min(len(values) // 2 * 2 - 1, max(5, round(0.1 / record.step_s) | 1))
    rate = savgol_filter(values, window, min(3, window - 1), deriv=1, delta=record.step_s)
    step = record.steps[index]
    slow = LinearStructure("integrator", ("y",), (), 1)
    found = (
        f"{record.output_names[index]}: {values.min():.4g} to {values.max():.4g} {unit}, fastest "
        f"{np.abs(rate).max():.3g} {unit}/s, moves most at {dominant_rad_s(one, slow):.3g} rad/s"
    )
    return found + ("" if not step else f", in steps of {step:.3g} {unit}")


def _loop(record: Record, index: int) -> str:
    """Return bandwidth and damping of the loop from a set-point to the output that follows it."""
    name = record.input_names[index]
    best = None
    for output in range(record.outputs.shape[1]):
        one = Record(
            record.step_s, record.outputs[:, output : output + 1], record.inputs[:, index : index + 1]
        )
        try:
            found = identify(one, LinearStructure("siso:2,1", ("y",), ("u",), 2, 1))
        except IdentificationError:
            continue
        explained = 0.0 if found.check is None else found.check.explained
        if best is None or explained > best[0]:
            best = explained, output, found
    if best is None or best[0] < 0.5 or best[2].values["a_2"] <= 0.0:
        return f"{name}: no output follows it as one loop would"
    values = best[2].values
    frequency = math.sqrt(values["a_2"])
    omega = np.geomspace(0.01 * frequency, 100.0 * frequency, 4000)
    s = 1j * omega
    response = (values["b_0"] * s + values["b_1"]) / (s * s + values["a_1"] * s + values["a_2"])
    above = np.abs(response) >= abs(values["b_1"] / values["a_2"]) / math.sqrt(2.0)
    bandwidth = omega[np.flatnonzero(above)[-1]] if np.any(above) else math.nan
    return (
        f"{name} to {record.output_names[best[1]]}, the closed loop: bandwidth {bandwidth:.3g} rad/s, "
        f"own frequency {frequency:.3g} rad/s, damping ratio {0.5 * values['a_1'] / frequency:.2g}, "
        f"steady gain {values['b_1'] / values['a_2']:.3g}; it explains {best[0]:.0%} of the motion"
    )
