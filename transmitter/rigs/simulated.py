"""Rigs without a device: a simulated plant, a recorded flight; and any rig, its motors left alone."""

from __future__ import annotations

import math
from collections.abc import Sequence

from channel.codec.codec import Vector
from channel.flight_log import FlightLog
from plant_sim.encoder import OutputReader
from plant_sim.plant import Plant
from transmitter.rigs.base import Reading, Rig, RigError


class SimulatedRig(Rig):
    """A plant with its own time: at tick `n` it has made `n` steps, even if the loop was late."""

    name = "simulated"

    def __init__(
        self,
        plant: Plant,
        encoders: tuple[OutputReader, ...],
        safe_command: Vector,
        outputs: Sequence[str] = (),
    ) -> None:
        """`outputs` are their names, for messages."""
        self._plant = plant
        self._names = outputs
        self._encoders = encoders
        self._encoder = encoders[0] if len(encoders) == 1 else None
        self._safe_command = safe_command
        self._volts = safe_command
        self._tick = 0

    def read(self, tick: int) -> Reading:
        """Return the counts at a tick, and the true angles beside them."""
        while self._tick < tick:
            try:
                self._plant.advance(self._volts)
            except Exception as error:  # a plant from outside may fail in any way
                raise RigError(
                    f"the simulated plant failed after tick {self._tick}: {error}"
                ) from error
            self._tick += 1
        true = self._plant.measured
        for place, value in enumerate(true):
            if not math.isfinite(value):
                name = self._names[place] if place < len(self._names) else place + 1
                raise RigError(
                    f"the simulated plant's output {name} is {value} at tick {tick}; it must be finite"
                )
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
        self._volts = self._safe_command


class DryRig(Rig):
    """Reads another rig. A real one must have been built without its output as well."""

    def __init__(self, rig: Rig, motors: int = 2) -> None:
        self.name = f"{rig.name} (dry run)"
        self.is_real, self.is_recorded = rig.is_real, rig.is_recorded
        self._rig = rig
        self._nothing = (0.0,) * motors

    def open(self) -> None:
        self._rig.open()

    def read(self, tick: int) -> Reading | None:
        """Return its reading; the recorded commands moved the body."""
        reading = self._rig.read(tick)
        if reading is None or reading.applied_volts is not None:
            return reading
        return reading._replace(applied_volts=self._nothing)

    def write(self, tick: int, volts: Vector) -> None:
        """Do nothing."""

    def close(self) -> None:
        self._rig.close()

    def figures(self) -> dict[str, object]:
        return {**self._rig.figures(), "dry_run": True}


class ReplayRig(Rig):
    """Reads one row per tick; commands have no effect."""

    name = "replay"
    is_recorded = True

    def __init__(self, log: FlightLog) -> None:
        self._log = log

    def read(self, tick: int) -> Reading | None:
        if tick >= len(self._log):
            return None
        log = self._log
        applied = tuple(log.commands[tick].tolist()) or None
        return Reading(
            tuple(log.counts[tick].tolist()), tuple(log.measured[tick].tolist()), applied_volts=applied
        )

    def write(self, tick: int, volts: Vector) -> None:
        """Do nothing: this flight is over."""
