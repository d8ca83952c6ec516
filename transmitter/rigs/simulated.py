"""A simulated rig: a plant, and encoders that round its angles to counts."""

from __future__ import annotations

from channel.codec.codec import Vector
from plant_sim.encoder import OutputReader
from plant_sim.plant import Plant
from transmitter.rigs.base import Reading, RigBase


class SimulatedRig(RigBase):
    """A plant that goes on by itself: at tick `n` it has had `n` steps, whoever was held up."""

    name = "simulated"

    def __init__(self, plant: Plant, encoders: tuple[OutputReader, ...], safe_command: Vector) -> None:
        self._plant = plant
        self._encoders = encoders
        self._encoder = encoders[0] if len(encoders) == 1 else None
        self._safe_command = safe_command
        self._volts = safe_command
        self._tick = 0

    def read(self, tick: int) -> Reading:
        """Return the counts at a tick, and the true angles beside them."""
        while self._tick < tick:
            self._plant.advance(self._volts)
            self._tick += 1
        true = self._plant.measured_rad
        if len(true) == 1 and self._encoder is not None:
            count, value = self._encoder.read(true[0])
            return Reading((count,), (value,), true)
        pairs = zip(self._encoders, true, strict=True)
        counts, values = zip(*[encoder.read(value) for encoder, value in pairs], strict=True)
        return Reading(counts, values, true)

    def write(self, tick: int, volts: Vector) -> None:
        """Hold these voltages on the motors from this tick on."""
        self._volts = volts

    def safe_stop(self) -> None:
        """Put the safe voltage on the motors."""
        self._volts = self._safe_command
