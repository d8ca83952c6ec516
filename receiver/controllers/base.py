"""The interface of every controller."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

from channel.codec.codec import Model
from channel.codec.signals import Signals
from receiver.controllers.references import Constant, Reference


@dataclass(frozen=True, slots=True)
class ControllerContext:
    """The context that an external controller gets when it is built."""

    tick_s: float
    """time between two commands"""
    references: tuple[Reference | None, ...]
    """the configured set-point of each output, `references[0].value(tick)`; None: it has none"""
    command_max: tuple[float, ...]
    """where each input is clamped"""
    initial_command: tuple[float, ...]
    """before the first command; a command has as many values"""
    signals: Signals
    """names and units of states, inputs and outputs"""
    model: Model
    """the codec's model, whose state is estimated"""

    @property
    def reference(self) -> Any:
        return self.references[0] or Constant(0.0, self.tick_s)


class Controller(Protocol):
    """A law that turns the estimated state into a command, once per control tick.

    It runs at the receiver only: its commands are sent to the other end, so it may use any
    arithmetic and keep any memory.
    """

    def command(self, tick: int, state: tuple[float, ...]) -> tuple[float, ...]:
        """Return the command for `tick`, one value for each input of the model.

        Called once for every tick, in order; the first tick is the command lead. `state` is the
        model state estimated for that tick.
        """
        ...

    def references(self, tick: int) -> tuple[float | None, ...]:
        """Return the set-point of each output at `tick`; None if it has none.

        Outputs after the last one given have none either.
        """
        ...
