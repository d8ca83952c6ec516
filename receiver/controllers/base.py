"""The interface of every controller."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from receiver.controllers.references import Reference


@dataclass(frozen=True, slots=True)
class ControllerContext:
    """The context that a controller from outside gets when it is built."""

    tick_s: float
    """time between two commands"""
    reference: Reference
    """the configured set-point: `reference.angle_rad(tick)`"""
    volts_max: float
    """where each motor's voltage is clamped"""
    initial_command: tuple[float, ...]
    """motor voltages before the first command; a command has as many"""


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
