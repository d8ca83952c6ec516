"""Sources of a pitch record: the configured rig, or a log."""

from __future__ import annotations

from plant_sim.identification.errors import IdentificationError
from plant_sim.identification.excitation import excite, parse_excitation
from plant_sim.identification.record import PitchRecord
from tenbaud.build.flight_log import read_flight_log
from tenbaud.build.rig import build_rig
from tenbaud.config.schema import FlightConfig


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
