"""A rig whose motors are left alone: everything is read, nothing is ever written."""

from __future__ import annotations

from channel.codec.codec import Vector
from transmitter.rigs.base import Reading, Rig


class DryRig(Rig):
    """Reads another rig. A real one must have been built without its output as well."""

    def __init__(self, rig: Rig, motors: int = 2) -> None:
        self.name = f"{rig.name} (dry run)"
        self.is_real = rig.is_real
        self._rig = rig
        self._nothing = (0.0,) * motors

    def open(self) -> None:
        """Open the rig."""
        self._rig.open()

    def read(self, tick: int) -> Reading | None:
        """Return its reading; what turned the body was not us."""
        reading = self._rig.read(tick)
        if reading is None or reading.applied_volts is not None:
            return reading
        return reading._replace(applied_volts=self._nothing)

    def write(self, tick: int, volts: Vector) -> None:
        """Do nothing."""

    def close(self) -> None:
        """Give the rig back."""
        self._rig.close()

    def figures(self) -> dict[str, object]:
        """Return what the rig counted."""
        return {**self._rig.figures(), "dry_run": True}
