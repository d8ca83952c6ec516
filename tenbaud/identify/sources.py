"""Sources of a pitch record: the configured rig, the folder of a run, or a log."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np

from plant_sim.identification.errors import IdentificationError
from plant_sim.identification.excitation import excite, parse_excitation
from plant_sim.identification.record import PitchRecord
from tenbaud.build.flight_log import read_flight_log
from tenbaud.build.rig import build_rig
from tenbaud.config.schema import FlightConfig
from tenbaud.recording.folder import find_recordings
from tenbaud.recording.reader import Recording


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


def from_log(config: FlightConfig) -> PitchRecord:
    """Return the record in the log that a configuration names; LogError where it cannot be used."""
    log = read_flight_log(config)
    if log.measured.shape[1] != 1 or log.commands.shape[1] != 2:
        raise IdentificationError(
            f"{config.flight_log.file}: the pitch model has one angle and two voltages; --columns says "
            "which: angle=NAME,front=NAME,rear=NAME, and 0 for a motor without a column"
        )
    front, rear = log.commands.T
    return PitchRecord(log.tick_s, log.measured[:, 0], front, rear)
