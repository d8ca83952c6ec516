"""Sources of a pitch record: the configured rig, the folder of a run, or a CSV log."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Literal

import numpy as np

from channel.flight_log import parse_number, read_columns
from plant_sim.identification.errors import IdentificationError
from plant_sim.identification.excitation import excite, parse_excitation
from plant_sim.identification.record import PitchRecord
from tenbaud.build.rig import build_rig
from tenbaud.build.signals import build_encoders, configured_signals
from tenbaud.config.schema import FlightConfig
from tenbaud.recording.folder import find_recordings
from tenbaud.recording.reader import Recording

AngleUnit = Literal["counts", "rad", "deg"]


@dataclass(frozen=True, slots=True)
class LogColumns:
    """The columns of a log; a time column, if there is one, is in seconds."""

    angle: str = "pitch_counts"
    front: str = "right_volts"
    rear: str = "left_volts"
    index: str = "step"
    time: str = ""
    unit: AngleUnit = "counts"


def parse_columns(text: str, unit: AngleUnit, base: LogColumns) -> LogColumns:
    """Return the columns of a command line such as `angle=pitch,front=u1,rear=u2,time=t`."""
    values = {
        "angle": base.angle,
        "front": base.front,
        "rear": base.rear,
        "index": base.index,
        "time": base.time,
    }
    for piece in filter(None, text.split(",")):
        name, equals, column = piece.partition("=")
        if name.strip() not in values or not equals:
            raise IdentificationError(
                f"--columns: '{piece}' is not NAME=COLUMN with a name of {', '.join(values)}"
            )
        values[name.strip()] = column.strip()
    return LogColumns(**values, unit=unit)


def from_rig(config: FlightConfig, excitation: str, duration_s: float) -> PitchRecord:
    """Excite the configured rig and return what its encoder saw."""
    tick_s = config.timing.tick_s
    with build_rig(config) as rig:

        def step(tick: int, front: float, rear: float) -> float | None:
            reading = rig.read(tick)
            rig.write(tick, (front, rear))
            return None if reading is None else reading.measured[0]

        signal = parse_excitation(excitation, tick_s)
        force = config.receiver.pid.normal_force_volts
        return excite(step, signal, tick_s, duration_s, normal_force_volts=force)


def from_run(folder: Path) -> PitchRecord:
    """Return the measured angles and applied voltages of a run's transmitter."""
    recording = Recording(find_recordings(folder)[0])
    ticks, rows = [], []
    for _, row in recording.rows("tick"):
        if not row.get("measured") or len(row.get("applied") or ()) != 2:
            continue  # a tick without a reading: a gap, reported below
        ticks.append(row["tick"])
        rows.append((row["measured"][0], *row["applied"]))
    if not ticks:
        raise IdentificationError(
            f"{recording.path} holds no measured angles; give the run's transmitter.mcap"
        )
    for before, after in pairwise(ticks):
        if after != before + 1:
            raise IdentificationError(
                f"{recording.path}: after tick {before} comes {after}; a record with gaps cannot be "
                "identified across them: choose a stretch with --from and --to"
            )
    columns = np.array(rows, dtype=np.float64)
    try:
        step_s = float(recording.metadata["tick_s"])
    except (KeyError, ValueError):
        raise IdentificationError(f"{recording.path} does not say how long its ticks are") from None
    return PitchRecord(step_s, columns[:, 0], columns[:, 1], columns[:, 2])


def from_csv(path: Path, columns: LogColumns, config: FlightConfig) -> PitchRecord:
    """Return the record in a CSV file; FlightLogError or IdentificationError name line and fault.

    Without a time column the rows are one tick of the configuration apart, and the index column, if
    the file has it, must count them by ones.
    """
    clock = columns.time or columns.index
    values = (columns.angle, columns.front, columns.rear)
    names = (clock, *values) if clock else values
    lines, rows = [], []
    for line, cells in read_columns(path, names):
        named = zip(cells, names, strict=True)
        rows.append([parse_number(cell, path, line, name) for cell, name in named])
        lines.append(line)
    table = np.array(rows, dtype=np.float64)
    if not len(table):
        raise IdentificationError(f"{path} has a header and no rows")
    step_s = config.timing.tick_s
    if clock:
        step_s = _even_step(path, table[:, 0], lines, clock, step_s, timed=bool(columns.time))
        table = table[:, 1:]
    angle = table[:, 0]
    if columns.unit == "counts":
        encoder = build_encoders(config, configured_signals(config))[0]
        angle = np.array([encoder.angle_rad(round(count)) for count in angle.tolist()])
    elif columns.unit == "deg":
        angle = np.radians(angle)
    return PitchRecord(step_s, angle, table[:, 1], table[:, 2])


def _even_step(
    path: Path, clock: np.ndarray, lines: list[int], name: str, tick_s: float, *, timed: bool
) -> float:
    """Return the sampling time, or raise where the clock column jumps."""
    if len(clock) < 2:
        raise IdentificationError(f"{path} has a single row")
    steps = np.diff(clock)
    usual = float(np.median(steps)) if timed else 1.0
    if usual <= 0.0:
        raise IdentificationError(f"{path}, column {name}: the times do not rise")
    bad = np.flatnonzero(np.abs(steps - usual) > 0.1 * usual)
    if len(bad):
        row = int(bad[0])
        raise IdentificationError(
            f"{path}, line {lines[row + 1]}, column {name}: {clock[row + 1]:g} after {clock[row]:g}, "
            f"where the usual step is {usual:g}; a gap cannot be identified across: choose a stretch "
            "with --from and --to before or after it, as a separate file"
        )
    return usual if timed else tick_s
