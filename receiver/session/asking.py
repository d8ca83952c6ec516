"""Asking a controller, which may be anybody's code: what it gives is checked, and it may fail."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sized
from math import isfinite

from channel.codec.codec import Vector
from channel.protocol.events import Event, EventKind, Failing, Tell
from channel.protocol.limits import are_plausible
from receiver.controllers.base import Controller


class Asker:
    """Asks for commands and set-points; the flight goes on without a controller that fails.

    `counts` gets `bad_commands` and `bad_references`, and `emit` gets an event for the first of each.
    """

    def __init__(self, controller: Controller, outputs: int, counts: Counter[str], emit: Tell) -> None:
        self._controller = controller
        self._no_references: tuple[float | None, ...] = (None,) * outputs
        self._counts = counts
        self._emit = emit
        self.first_problem = ""
        """of the controller's commands"""

    def command(self, tick: int, state: Vector, hold: Vector) -> Vector:
        """Return the controller's command; `hold` if it fails or is not finite."""
        command: Vector = ()
        try:
            command = self._controller.command(tick, state)
            if len(command) == len(hold) and are_plausible(command):
                return command
            problem = f"wants {command}"
        except Exception as error:  # a controller is the user's code; the flight goes on without it
            problem = f"failed: {type(error).__name__}: {error}"
            if not isinstance(command, Sized):
                problem = f"wants {command!r}, and not a tuple of {len(hold)} number(s)"
        self._counts["bad_commands"] += 1
        if self._counts["bad_commands"] == 1:
            self.first_problem = problem
            self._emit(Event(EventKind.CONTROLLER, tick=tick, cause=Failing.COMMAND, detail=problem))
        return hold

    def references(self, tick: int) -> tuple[float | None, ...]:
        """Return the set-point of each output; None for one that has none."""
        try:
            given = self._controller.references(tick)
            references = tuple([None if one is None else float(one) for one in given])
            if not all(one is None or isfinite(one) for one in references):
                raise ValueError(f"wants {given}")
            if len(references) == len(self._no_references):
                return references
            if len(references) < len(self._no_references):
                return (*references, *self._no_references[len(references) :])
            problem = f"{len(references)} set-points for {len(self._no_references)} output(s)"
        except Exception as error:  # the user's code too
            problem = f"{type(error).__name__}: {error}"
        self._counts["bad_references"] += 1
        if self._counts["bad_references"] == 1:
            self._emit(Event(EventKind.CONTROLLER, tick=tick, cause=Failing.REFERENCE, detail=problem))
        return self._no_references
