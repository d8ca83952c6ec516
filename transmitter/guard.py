"""The guard beside the motors: limiter and watchdog.

At every tick it decides the command of the motors. A command passes, in this order, a finite check, the
clamp and the slew limit; with the soft limit of an output exceeded, or a sensor that cannot be trusted,
nothing passes. Without commands the last one is held; after the time-out the command ramps to the safe
one and stays there, latched: while it is latched no symbol is sent. It is re-armed only on
request.

The age of a command counts the ticks for which one was due (`transmitter.session.owing`) but missing.
"""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass
from enum import StrEnum

from channel.codec.codec import Vector
from channel.codec.signals import Signal
from channel.protocol.limits import CommandLimits


class GuardState(StrEnum):
    """The state of the guard."""

    READY = "ready"
    RUNNING = "running"
    HOLDING = "holding"
    RAMPING = "ramping"
    LATCHED = "latched"


class GuardCause(StrEnum):
    """Why the guard ramps the command down."""

    TIMED_OUT = "timed_out"
    """commands were missing: the only cause that later commands can clear"""
    STOPPED = "stopped"
    """a person or a signal stopped the flight"""
    SESSION_ENDED = "session_ended"
    FLIGHT_OVER = "flight_over"
    """a real rig's motors are taken down after the flight"""
    SENSOR = "sensor"
    ANGLE_LIMIT = "angle_limit"
    NO_ANGLE = "no_angle"
    """an angle that is not a finite number"""
    BAD_COMMAND = "bad_command"
    """a command that is not a finite number"""


@dataclass(frozen=True, slots=True)
class GuardReason:
    """A cause with its numbers."""

    cause: GuardCause
    tick: int | None = None
    axis: int | None = None
    value: float | None = None
    limit: float | None = None
    number: int | None = None
    """ticks for which a command was due but missing"""
    detail: str | None = None
    """for people: the text of the sensor's device, or the name of the output"""


@dataclass(frozen=True, slots=True)
class GuardSettings:
    """Limits and times of the guard. Times are in ticks."""

    timeout_ticks: int
    """age of the last command after which the guard ramps it down"""
    ramp_ticks: int
    """duration of the ramp to the safe command"""
    safe_command: Vector
    soft_limits: Vector = ()
    """largest value of each output, either way; empty: none"""
    outputs: tuple[Signal, ...] = ()
    """names of the outputs, for messages"""

    def __post_init__(self) -> None:
        if self.timeout_ticks < 1 or self.ramp_ticks < 1:
            raise ValueError(
                "the guard's time-out and ramp take at least one tick, got "
                f"{self.timeout_ticks} and {self.ramp_ticks}"
            )


class Guard:
    """Decides the applied command at every tick."""

    def __init__(self, limits: CommandLimits, settings: GuardSettings) -> None:
        self._limits = limits
        self._settings = settings
        self.state = GuardState.READY
        self.reason: GuardReason | None = None
        """why it ramps or latched"""
        self.command = settings.safe_command
        """what is applied"""
        self._age_ticks = 0
        self._tick: int | None = None
        """the last one applied"""
        self._ramp_from = settings.safe_command
        self._ramp_tick = 0

    @property
    def stopped(self) -> bool:
        return self.state is GuardState.RAMPING or self.state is GuardState.LATCHED

    @property
    def timed_out(self) -> bool:
        """Return whether missing commands are the only cause of its stop."""
        return self.reason is not None and self.reason.cause is GuardCause.TIMED_OUT

    def check_outputs(self, tick: int, measured: Vector) -> None:
        """Trip when an output is beyond its soft limit or not a number."""
        limits = self._settings.soft_limits
        for axis, value in enumerate(measured):
            if not math.isfinite(value):
                self._trip_output(GuardCause.NO_ANGLE, tick, axis, value)
            elif limits and abs(value) > limits[axis]:
                self._trip_output(GuardCause.ANGLE_LIMIT, tick, axis, value, limits[axis])

    def _trip_output(
        self, cause: GuardCause, tick: int, axis: int, value: float, limit: float | None = None
    ) -> None:
        outputs = self._settings.outputs
        label = outputs[axis].label if outputs else None
        self.trip(GuardReason(cause, tick, axis, value, limit, detail=label))

    def trip(self, reason: GuardReason) -> None:
        """Ramp the command down from now on."""
        if not self.stopped:
            self.state = GuardState.RAMPING
            self.reason = reason
            self._ramp_from = self.command
            self._ramp_tick = 0
        elif self.timed_out and reason.cause is not GuardCause.TIMED_OUT:
            # Something worse than silence: no command makes it good again.
            self.reason = reason

    def rearm(self) -> None:
        """Pass commands again, starting from the applied one."""
        if not self.timed_out:
            raise RuntimeError(f"the guard cannot be re-armed: {self.reason or 'it is not stopped'}")
        self.state = GuardState.READY
        self.reason = None
        self._age_ticks = 0

    def apply(self, tick: int, command: Vector | None, owed_ticks: int = sys.maxsize) -> Vector:
        """Return the applied command of this tick; `command` is None if none has come.

        `owed_ticks`: number of ticks, up to this one, for which one was due.
        """
        if command is not None:
            for value in command:
                if not math.isfinite(value):
                    self.trip(GuardReason(GuardCause.BAD_COMMAND, tick, value=value))
        if not self.stopped:
            self._take(tick, command, owed_ticks)
        if self.state is GuardState.RAMPING:
            self._ramp()
        self._tick = tick
        return self.command

    def _take(self, tick: int, command: Vector | None, owed_ticks: int) -> None:
        if command is not None:
            self.state = GuardState.RUNNING
            self._age_ticks = 0
            self.command = self._limits.apply(command, self.command)
            return
        # Ticks that were missed pass as well: the watchdog counts time.
        passed_ticks = 1 if self._tick is None else tick - self._tick
        self._age_ticks = min(self._age_ticks + passed_ticks, owed_ticks)
        if self.state is GuardState.RUNNING:
            self.state = GuardState.HOLDING
        if self._age_ticks > self._settings.timeout_ticks:
            self.trip(GuardReason(GuardCause.TIMED_OUT, tick, number=self._age_ticks))

    def _ramp(self) -> None:
        self._ramp_tick += 1
        left = 1.0 - self._ramp_tick / self._settings.ramp_ticks
        if left <= 0.0:
            self.state = GuardState.LATCHED
            self.command = self._settings.safe_command
            return
        self.command = tuple(
            safe + (start - safe) * left
            for start, safe in zip(self._ramp_from, self._settings.safe_command, strict=True)
        )
