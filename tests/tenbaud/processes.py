"""Runs the command as its users do: as processes, in an empty folder."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

REPOSITORY = Path(__file__).parents[2]
TIMEOUT_S = 300.0


@dataclass(frozen=True)
class Ended:
    """What a process left behind."""

    code: int
    out: str
    err: str

    @property
    def summary(self) -> dict[str, Any]:
        """The JSON on standard output."""
        return json.loads(self.out)


def start(
    *arguments: str,
    cwd: Path,
    environment: dict[str, str] | None = None,
    code: str | None = None,
) -> subprocess.Popen[str]:
    """Start `tenbaud` with these arguments; with `code`, Python source that calls it at its end."""
    how = ["-c", code] if code is not None else ["-m", "tenbaud"]
    path = os.pathsep.join([str(REPOSITORY), os.environ.get("PYTHONPATH", "")])
    return subprocess.Popen(
        [sys.executable, *how, *arguments],
        cwd=cwd,
        env={**os.environ, "PYTHONPATH": path, "COLUMNS": "200", **(environment or {})},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def finish(process: subprocess.Popen[str], timeout_s: float = TIMEOUT_S) -> Ended:
    """Wait for a process; one that does not end fails the test with what it said."""
    try:
        out, err = process.communicate(timeout=timeout_s)
    except subprocess.TimeoutExpired:
        process.kill()
        out, err = process.communicate()
        raise AssertionError(f"the process did not end in {timeout_s} s\n{out}\n{err}") from None
    return Ended(process.returncode, out, err)


def run(
    *arguments: str, cwd: Path, environment: dict[str, str] | None = None, code: str | None = None
) -> Ended:
    """Run `tenbaud` to its end."""
    return finish(start(*arguments, cwd=cwd, environment=environment, code=code))


def fly_pair(
    cwd: Path,
    *shared: str,
    transmitter: dict[str, Any] | None = None,
    receiver: dict[str, Any] | None = None,
) -> tuple[Ended, Ended]:
    """Run `receive` and `transmit` over a free loopback port; return (transmitter, receiver).

    The two dictionaries hold `arguments`, `environment` and `code` for that end alone.
    """
    from channel.links.endpoints import free_endpoint

    endpoint = free_endpoint()
    ends = []
    for verb, flag, extra in (
        ("receive", "--listen", receiver or {}),
        ("transmit", "--connect", transmitter or {}),
    ):
        arguments = [verb, flag, endpoint, "--json", "--out", f"{verb}-run", *shared]
        arguments += extra.get("arguments", [])
        ends.append(
            start(
                *arguments,
                cwd=cwd,
                environment=extra.get("environment"),
                code=extra.get("code"),
            )
        )
    lower, upper = (finish(end) for end in ends)
    return upper, lower
