"""Sources of a record: the configured rig, a log or a run, or arrays."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from channel.codec.signals import Signals
from plant_sim.identification.errors import IdentificationError
from plant_sim.identification.excitation import excite, parse_excitation
from plant_sim.identification.record import Record
from tenbaud.build.rig import build_rig
from tenbaud.build.signals import build_encoders, configured_signals
from tenbaud.config.schema import FlightConfig

ALIASES = ("angle", "output", "input", "time", "index", "front", "rear")


@dataclass(frozen=True, slots=True, eq=False)
class Source:
    """A record, its name, and what was done to the file that it is from."""

    name: str
    record: Record
    notes: tuple[str, ...] = ()
    file: Path | None = None


def from_rig(config: FlightConfig, excitation: str, duration_s: float) -> Record:
    """Excite the configured rig and return what its encoder saw."""
    tick_s = config.timing.tick_s
    signals = configured_signals(config)
    if len(signals.outputs) != 1 or len(signals.inputs) != 2:
        raise IdentificationError(
            "only a pitch axis is excited by this command; record a flight of this rig, with its "
            "commands, and give the file or the folder of the run"
        )
    with build_rig(config) as rig:

        def step(tick: int, front: float, rear: float) -> float | None:
            reading = rig.read(tick)
            rig.write(tick, (front, rear))
            return None if reading is None else reading.measured[0]

        signal = parse_excitation(excitation, tick_s)
        force = config.receiver.pid.normal_force_volts
        return excite(step, signal, tick_s, duration_s, normal_force_volts=force)


def from_log(config: FlightConfig, structure: str = "") -> tuple[Record, tuple[str, ...]]:
    """Return the record in the log that a configuration names, and what was done to the file.

    The signals are those of the model, or the file's own where the structure is none of the model.
    LogError where the file cannot be used.
    """
    from tenbaud.log.read import read_log

    # On the file's own clock: a flight may resample it, an identification need not.
    signals = None if _own_signals(config, structure) else configured_signals(config)
    encoders = () if signals is None else build_encoders(config, signals)
    log = read_log(config.flight_log, signals, encoders, config.timing.tick_s)
    return record_of(log.tick_s, log.measured, log.commands, log.signals), log.notes


def record_of(step_s: float, outputs: np.ndarray, inputs: np.ndarray, signals: Signals) -> Record:
    """Return a record with the names and units of signals."""
    taken = signals.inputs[: inputs.shape[1]]
    return Record(
        step_s,
        outputs,
        inputs,
        tuple([one.name for one in signals.outputs]),
        tuple([one.name for one in taken]),
        tuple([one.unit for one in signals.outputs]),
        tuple([one.unit for one in taken]),
    )


def _own_signals(config: FlightConfig, structure: str) -> bool:
    """Return whether a log's signals are its own, and not those of the configured model."""
    if structure and structure != "pitch":
        return config.model.kind in ("pitch", "hold", "pendulum")
    log = config.flight_log
    signals = configured_signals(config)
    known = {one.name for one in (*signals.outputs, *signals.inputs)}
    named = {*log.columns, *log.outputs, *log.inputs}
    return any(name not in known and name not in ALIASES and not name.isdigit() for name in named)
