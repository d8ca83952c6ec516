"""A controller that repeats the commands of a recorded flight."""

from __future__ import annotations

from channel.flight_log import FlightLog


class RecordedController:
    """A `Controller` for replays: row `tick` of the log is the command of `tick`.

    The estimated state is ignored, because the flight has already happened.
    """

    def __init__(self, log: FlightLog) -> None:
        """Replay `log`; ValueError when it has no inputs."""
        if not log.commands.shape[1]:
            raise ValueError("the flight log holds no inputs; --columns NAME=COLUMN says which are")
        self._commands = log.commands
        self._last_row = len(log) - 1

    def command(self, tick: int, state: tuple[float, ...]) -> tuple[float, ...]:
        """Return the inputs of row `tick`; past the end, those of the last row.

        `state` is not read. Raises ValueError for a tick below 0.
        """
        if tick < 0:
            raise ValueError(f"tick is {tick}; it must be at least 0")
        return tuple(self._commands[min(tick, self._last_row)].tolist())

    def references(self, tick: int) -> tuple[float | None, ...]:
        """Return none: a recorded flight follows no reference of ours."""
        return ()
