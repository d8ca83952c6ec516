"""Commands of viewers that wait for the loop."""

from __future__ import annotations

from collections import deque

from pydantic import ValidationError

from tenbaud.telemetry.schema import COMMAND, Command

WAITING_MAX = 64


class CommandQueue:
    """A bounded queue; commands that make no sense, or come while it is full, are counted and gone."""

    def __init__(self) -> None:
        self.refused = 0
        self._waiting: deque[Command] = deque()

    def offer(self, data: bytes) -> None:
        """Take the bytes of one command; called by a thread of the network."""
        try:
            command = COMMAND.validate_json(data)
        except ValidationError:
            self.refused += 1
            return
        if len(self._waiting) >= WAITING_MAX:
            self.refused += 1
        else:
            self._waiting.append(command)

    def take(self) -> Command | None:
        """Return the next command, None when none waits; called by the loop, at its boundaries."""
        return self._waiting.popleft() if self._waiting else None
