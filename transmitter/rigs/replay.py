"""A recorded flight as the rig: its encoder counts come again, its voltages were applied already."""

from __future__ import annotations

from channel.codec.codec import Vector
from channel.flight_log import FlightLog
from plant_sim.encoder import OutputReader, angles_rad
from transmitter.rigs.base import Reading, RigBase


class ReplayRig(RigBase):
    """Reads one row per tick; what is written to it changes nothing."""

    name = "replay"

    def __init__(self, log: FlightLog, encoders: tuple[OutputReader, ...]) -> None:
        self._log = log
        self._encoders = encoders

    def read(self, tick: int) -> Reading | None:
        """Return the row of a tick, None past the last."""
        if tick >= len(self._log):
            return None
        counts = self._log.counts[tick]
        volts = self._log.volts[tick] if self._log.volts else None
        return Reading(counts, angles_rad(self._encoders, counts), applied_volts=volts)

    def write(self, tick: int, volts: Vector) -> None:
        """Do nothing: this flight is over."""
