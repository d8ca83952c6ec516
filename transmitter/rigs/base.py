"""The rig as the transmitter sees it: encoder counts in, motor voltages out."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import NamedTuple, Self

from channel.codec.codec import Vector
from channel.errors import TenbaudError


class RigError(TenbaudError):
    """A rig that cannot be opened or used; the text says what to do next."""


@dataclass(frozen=True, slots=True)
class DeviceNote:
    """A real device's report with a reading, beside the measured axes."""

    counts: tuple[int, ...]
    """of every encoder channel, those that are not measured axes too"""
    device_s: float | None
    """its own time since its first sample"""
    age_ms: float
    """how long ago the sample arrived"""
    lost: int
    """samples that are missing in its sequence so far"""


class Reading(NamedTuple):
    """One reading of the rig. There is one for every tick, so it is a plain tuple."""

    counts: tuple[int, ...]
    """of the encoders, unwrapped"""
    measured: Vector
    """the same as angles"""
    true: Vector | None = None
    """true angles, where the rig is simulated"""
    applied_volts: Vector | None = None
    """voltages that were applied regardless of ours, in a recorded flight"""
    fault: str | None = None
    """why this reading cannot be trusted; the guard takes the rig to its safe voltage"""
    device: DeviceNote | None = None
    """of a real rig"""


class Rig(ABC):
    """A plant with encoders and motors. `read` and `write` alternate, one pair per tick.

    The methods that are not abstract are those of a rig without a device.
    """

    name = ""
    is_real = False
    """a body that moves in real time: it cannot be flown on the virtual clock"""
    is_recorded = False
    """a recorded flight: it needs no protection"""
    ramps_down = False
    """after a flight the voltages are taken down along the guard's ramp, not dropped"""

    def open(self) -> None:  # noqa: B027, most need nothing
        """Get ready; the motors stay off."""

    @abstractmethod
    def read(self, tick: int) -> Reading | None:
        """Return the reading of a tick; None when the rig has no more (a recording has ended)."""

    @abstractmethod
    def write(self, tick: int, volts: Vector) -> None:
        """Put these voltages on the motors until the next tick."""

    def safe_stop(self) -> None:  # noqa: B027, most have nothing that turns
        """Put the safe voltage on the motors at once."""

    def close(self) -> None:
        """Leave the rig at its safe voltage and close it."""
        self.safe_stop()

    def figures(self) -> dict[str, object]:
        """Return the rig's counts, for the summary; empty if there are none."""
        return {}

    def __enter__(self) -> Self:
        self.open()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
