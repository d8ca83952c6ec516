"""What every controller offers to the controller node."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from receiver.controllers.references import Reference


@dataclass(frozen=True, slots=True)
class ControllerContext:
    """What a controller from outside is given when it is built."""

    tick_s: float
    """time between two commands"""
    reference: Reference
    """the configured set-point: `reference.angle_rad(tick)`"""
    command_max: tuple[float, ...]
    """where each input is clamped"""
    initial_command: tuple[float, ...]
    """before the first command; a command has as many values"""

    @property
    def volts_max(self) -> float:
        """Return where the first input is clamped, as it was called before inputs had names."""
        return self.command_max[0]


class Controller(Protocol):
    """A law that turns the estimated state into motor voltages, once per control tick.

    It runs at the receiver only: what it commands travels to the other end on the wire, so it is
    free to use any arithmetic and to keep any memory.
    """

    def command(self, tick: int, state: tuple[float, ...]) -> tuple[float, ...]:
        """Return the motor voltages (front, rear) for `tick`.

        Called once for every tick, in order; the first tick is the command lead. `state` is the
        model state estimated for that tick: angle (rad), rate (rad/s), then what the model adds.
        """
        ...

    def reference_rad(self, tick: int) -> float | None:
        """Return the angle the controller steers to at `tick`, or None when it follows none."""
        ...
