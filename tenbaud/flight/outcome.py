"""How a flight ended, for people and for exit codes."""

from __future__ import annotations

import signal
from dataclasses import dataclass
from enum import StrEnum

from channel.errors import ConfigMismatch, DesyncError, LinkLost, SafetyStop, TenbaudError
from channel.protocol.endings import End, Ending
from tenbaud.files.whole import WriteError
from tenbaud.sentences import endings
from tenbaud.sentences.exit_codes import ExitCode as ExitCode


class NotFlown(StrEnum):
    """The faults of a flight."""

    NEVER_LOCKED = "never locked"
    REJOINING = "rejoins without end"
    UNCONFIRMED = "too few samples confirmed"
    CONTROLLER = "the controller failed"
    FELL = "the plant fell"
    GUARD_DOWN = "guard down"
    NO_COMMANDS = "no commands in time"
    NO_WORDS = "no words"


@dataclass(frozen=True, slots=True)
class Outcome:
    """The end of a flight."""

    code: ExitCode
    text: str
    """for people; nothing reads it"""
    not_flown: tuple[NotFlown, ...] = ()
    """the faults of the flight, for NOT_FLOWN"""


SAFE = "the motors are at their safe voltage"


_ENDINGS = {
    ExitCode.OK: Ending.OVER,
    ExitCode.NOT_FLOWN: Ending.OVER,
    ExitCode.INTERRUPTED: Ending.STOPPED,
    ExitCode.LINK_LOST: Ending.LINK_LOST,
    ExitCode.DESYNC: Ending.DESYNC,
    ExitCode.SAFETY_STOP: Ending.SAFETY_STOP,
}
"""The ending sent to the other end, which decides itself whether the flight has flown."""


def farewell_of(outcome: Outcome) -> End:
    """Return the ending that an outcome sends to the other end."""
    ending = _ENDINGS.get(outcome.code, Ending.FAILED)
    return End(ending, "" if ending in (Ending.OVER, Ending.STOPPED) else outcome.text)


def first_cause(outcome: Outcome, trouble: str, consequence: str = "") -> Outcome:
    """Return the outcome, with the fault of this end's own line as its cause if that was lost.

    On a lost line the other end seems silent, and the outcome would blame it.
    """
    if outcome.code is not ExitCode.LINK_LOST or not trouble:
        return outcome
    return Outcome(outcome.code, "; ".join(filter(None, (trouble, consequence))))


def first_code(*codes: ExitCode) -> ExitCode:
    """Return the first code that is no success."""
    return next((code for code in codes if code is not ExitCode.OK), ExitCode.OK)


def outcome_of(error: BaseException) -> Outcome:
    """Return the outcome that an exception stands for."""
    if isinstance(error, KeyboardInterrupt):
        return Outcome(ExitCode.INTERRUPTED, "interrupted")
    for kind, code in (
        (ConfigMismatch, ExitCode.MISMATCH),
        (LinkLost, ExitCode.LINK_LOST),
        (DesyncError, ExitCode.DESYNC),
        (SafetyStop, ExitCode.SAFETY_STOP),
        (WriteError, ExitCode.NOT_WRITTEN),
        (TenbaudError, ExitCode.USAGE),
    ):
        if isinstance(error, kind):
            return Outcome(code, str(error))
    return Outcome(ExitCode.FAILED, f"{type(error).__name__}: {error}")


def outcome_of_status(name: str, status: int, last_words: str = "") -> Outcome:
    """Return the outcome that a child process' exit status stands for; `name` is what it was.

    `status` is as `subprocess` has it: negative for a signal. What the child said last is the text, but
    not for a signal: a killed process reports nothing.
    """
    if status < 0:
        try:
            killer = signal.Signals(-status).name
        except ValueError:
            killer = f"signal {-status}"
        return Outcome(ExitCode.FAILED, f"the {name} was killed by {killer}")
    try:
        code = ExitCode(status)
    except ValueError:
        code = ExitCode.FAILED
    if code is ExitCode.OK:
        return Outcome(code, last_words or endings.ending_text(Ending.OVER))
    return Outcome(code, last_words or f"the {name} ended with exit code {status}")
