"""How a flight ended, for people and for exit codes."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

from channel.errors import ConfigMismatch, DesyncError, LinkLost, SafetyStop, TenbaudError
from tenbaud.flight.verdict import NotFlown


class ExitCode(IntEnum):
    """Exit codes of every command."""

    OK = 0
    FAILED = 1
    USAGE = 2
    MISMATCH = 3
    LINK_LOST = 4
    DESYNC = 5
    SAFETY_STOP = 6
    NOT_FLOWN = 7
    INTERRUPTED = 130


@dataclass(frozen=True, slots=True)
class Outcome:
    """The end of a flight."""

    code: ExitCode
    text: str
    not_flown: tuple[NotFlown, ...] = ()
    """in what the flight fell short, for NOT_FLOWN"""


FLIGHT_OVER = "the flight is over"


def outcome_of(error: BaseException) -> Outcome:
    """Return the outcome that an exception stands for."""
    if isinstance(error, KeyboardInterrupt):
        return Outcome(ExitCode.INTERRUPTED, "interrupted")
    for kind, code in (
        (ConfigMismatch, ExitCode.MISMATCH),
        (LinkLost, ExitCode.LINK_LOST),
        (DesyncError, ExitCode.DESYNC),
        (SafetyStop, ExitCode.SAFETY_STOP),
        (TenbaudError, ExitCode.USAGE),
    ):
        if isinstance(error, kind):
            return Outcome(code, str(error))
    return Outcome(ExitCode.FAILED, f"{type(error).__name__}: {error}")
