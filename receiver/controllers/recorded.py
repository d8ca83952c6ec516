"""A controller that repeats the commands of a recorded flight."""

from __future__ import annotations

from channel.flight_log import FlightLog


class RecordedController:
    """A `Controller` for replays: row `tick` of the log is the command of `tick`.

    The estimated state is ignored, because the flight has already happened.
    """

    def __init__(self, log: FlightLog, inputs: int) -> None:
        """Replay `log`; `inputs` of the plant are zero where it has none."""
        self._commands = log.commands
        self._zero = (0.0,) * inputs
        self._last_row = len(log) - 1

    def command(self, tick: int, state: tuple[float, ...]) -> tuple[float, ...]:
        """Return the inputs of row `tick`; past the end, those of the last row; zeros without inputs.

        `state` is not read. Raises ValueError for a tick below 0.
        """
        if tick < 0:
            raise ValueError(f"tick is {tick}; it must be at least 0")
        return tuple(self._commands[min(tick, self._last_row)].tolist()) or self._zero

    def references(self, tick: int) -> tuple[float | None, ...]:
        """Return none: a recorded flight follows no reference of ours."""
        return ()
