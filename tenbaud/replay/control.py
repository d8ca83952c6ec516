"""The controller of a replayed flight: built as in the flight, or repeating its commands."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from channel.codec.signals import signals_of
from receiver.controllers.base import Controller
from receiver.controllers.references import Reference
from tenbaud.build.codec import build_model
from tenbaud.build.controllers import build_controller
from tenbaud.build.references import References, build_references
from tenbaud.config.schema import FlightConfig
from tenbaud.replay.pack import add_step
from tenbaud.replay.record import FlightRecord


class RecordedCommands:
    """A `Controller` that repeats recorded commands; a tick without one keeps the last."""

    def __init__(
        self,
        commands: Mapping[int, tuple[float, ...]],
        initial: tuple[float, ...],
        references: Mapping[int, tuple[float | None, ...]],
    ) -> None:
        self._commands = commands
        self._last = initial
        self._references = references

    def command(self, tick: int, state: tuple[float, ...]) -> tuple[float, ...]:
        self._last = self._commands.get(tick, self._last)
        return self._last

    def references(self, tick: int) -> tuple[float | None, ...]:
        return self._references.get(tick, ())


@dataclass(frozen=True, slots=True)
class SteppedReference:
    """The configured set-point, with manual changes over it: (tick, angle) steps."""

    configured: Reference
    steps: tuple[tuple[int, float], ...]

    def value(self, tick: int) -> float:
        found = self.configured.value(tick)
        for start, value in self.steps:
            if tick < start:
                break
            found = value
        return found


def steps_by_hand(record: FlightRecord) -> tuple[tuple[int, float], ...]:
    """Return the set-points that were recorded and are not the configuration's, as steps.

    () where the flight followed its configuration, as it does unless somebody moved the set-point.
    """
    if "receiver" not in record.rows:
        return ()
    reference = _references(record.agreement.config)[0]
    if reference is None:
        return ()
    steps: list[tuple[int, float]] = []
    for row in record.rows["receiver"].topics["tick"]:
        add_step(steps, row.tick, row.reference[0], reference)
    return tuple(steps)


def _references(config: FlightConfig) -> References:
    model = build_model(config)
    return build_references(config, signals_of(model), model)


def controller_of(config: FlightConfig, steps: tuple[tuple[int, float], ...] = ()) -> Controller:
    """Return the controller that was flown, with the set-points that it was given by hand."""
    if not steps:
        return build_controller(config)
    first, *others = _references(config)
    return build_controller(config, (first and SteppedReference(first, steps), *others))


def recorded_commands(record: FlightRecord) -> RecordedCommands | None:
    """Return the commands as they were recorded; None if not all of them were."""
    initial = record.agreement.terms.initial_command
    rows = record.rows.get("receiver")
    if rows is not None and rows.topics["tick"].recorded:
        commands = {row.tick: row.command for row in rows.topics["tick"]}
        references = {row.tick: row.reference for row in rows.topics["tick"]}
        return RecordedCommands(commands, initial, references)
    beside = record.rows.get("transmitter")
    if beside is None or not beside.topics["tick"].recorded:
        return None
    ticks = beside.topics["tick"].rows
    commands = {row.tick: row.commanded for row in ticks if row.commanded is not None}
    return RecordedCommands(commands, initial, {}) if len(commands) == len(ticks) else None
