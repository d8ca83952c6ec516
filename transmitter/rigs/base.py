"""The rig as the transmitter sees it: encoder counts in, motor voltages out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, Self

from channel.codec import Vector


@dataclass(frozen=True, slots=True)
class Reading:
    """One look at the rig."""

    counts: tuple[int, ...]
    """of the encoders, unwrapped"""
    measured_rad: Vector
    """the same as angles"""
    true_rad: Vector | None = None
    """true angles, where the rig is simulated"""
    applied_volts: Vector | None = None
    """voltages that were applied regardless of ours, in a recorded flight"""
    fault: str | None = None
    """why this reading cannot be trusted; the guard takes the rig to its safe voltage"""


class Rig(Protocol):
    """A plant with encoders and motors. `read` and `write` alternate, one pair per tick."""

    name: str

    def open(self) -> None:
        """Get ready; the motors stay off."""

    def read(self, tick: int) -> Reading | None:
        """Return the reading of a tick; None when the rig has no more (a recording has ended)."""

    def write(self, tick: int, volts: Vector) -> None:
        """Put these voltages on the motors until the next tick."""

    def safe_stop(self) -> None:
        """Put the safe voltage on the motors at once."""

    def close(self) -> None:
        """Leave the rig at its safe voltage and give it back."""

    def __enter__(self) -> Self: ...

    def __exit__(self, *_: object) -> None: ...


class RigBase:
    """Opening and closing for a `with`, the same for every rig."""

    name = ""

    def open(self) -> None:
        """Nothing to get ready."""

    def safe_stop(self) -> None:
        """Nothing turns."""

    def close(self) -> None:
        """Leave the rig safe."""
        self.safe_stop()

    def __enter__(self) -> Self:
        self.open()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
