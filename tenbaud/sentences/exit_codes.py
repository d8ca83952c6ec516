"""The exit codes of every command."""

from __future__ import annotations

from enum import IntEnum


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
    NOT_WRITTEN = 8
    INTERRUPTED = 130
