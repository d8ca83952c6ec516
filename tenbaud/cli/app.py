"""The process of a command, from its first moment to its exit code."""

from __future__ import annotations

import errno
import os
import signal
import sys
import warnings

NOT_WRITABLE = (errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EFBIG, errno.EIO)
"""Errors of writing alone."""


def main() -> None:
    """Run the command line; errors become one message and an exit code."""
    # Until the imports below are done, some tenths of a second, Ctrl-C ends this process as any other.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    # The matrices here are small. With several threads the linear algebra mostly waits, by spinning.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    from tenbaud.cli.streams import leave, lost_output, prepare_streams
    from tenbaud.cli.waiting import begin
    from tenbaud.flight.lifeline import follow_parent

    prepare_streams()
    waiting = begin(sys.argv[1:])
    warnings.formatwarning = lambda message, *_: f"tenbaud: {message}\n"  # no place in the code
    follow_parent()
    code = run(sys.argv[1:])
    waiting.end()
    error = lost_output()
    if error is not None:
        from tenbaud.flight.outcome import ExitCode

        _say(f"standard output cannot be written: {_reason(error)}; that output is lost")
        code = code or int(ExitCode.NOT_WRITTEN)
    leave(code)


def run(arguments: list[str]) -> int:
    """Run one command in this process, print its error, and return its exit code."""
    from channel.errors import TenbaudError
    from tenbaud.cli.commands import app_for
    from tenbaud.cli.units import plain_arguments
    from tenbaud.flight.outcome import ExitCode, outcome_of
    from tenbaud.flight.stop import Interruptions

    interruptions = Interruptions()
    try:
        with interruptions:
            app_for(arguments)(plain_arguments(arguments), prog_name="tenbaud")
    except SystemExit as ended:
        code = ended.code if isinstance(ended.code, int) else int(ExitCode.FAILED)
    except KeyboardInterrupt:
        code = int(ExitCode.INTERRUPTED)
    except (TenbaudError, ValueError) as error:
        _say(str(error))
        outcome = outcome_of(error)
        code = int(ExitCode.USAGE if outcome.code is ExitCode.FAILED else outcome.code)
    except OSError as error:
        what = f"{_shown(error.filename)}: " if error.filename is not None else ""
        _say(f"{what}{_reason(error)}")
        code = int(ExitCode.NOT_WRITTEN if error.errno in NOT_WRITABLE else ExitCode.USAGE)
    except RuntimeError as error:
        # An interrupt during an import, in `__set_name__`, comes out as one.
        if not isinstance(error.__cause__, KeyboardInterrupt):
            raise
        code = int(ExitCode.INTERRUPTED)
    else:
        code = 0
    if interruptions.received is not None:
        _say(f"interrupted by {interruptions.received.name}")
    return code


def _say(text: str) -> None:
    sys.stderr.write(f"tenbaud: {text}\n")


def _reason(error: OSError) -> str:
    return os.strerror(error.errno) if error.errno else str(error)


def _shown(name: object) -> str:
    return os.fsdecode(name) if isinstance(name, bytes) else str(name)
