"""The question before the motors of a real rig turn."""

from __future__ import annotations

import os
import sys
from dataclasses import dataclass
from typing import TYPE_CHECKING

import typer

if TYPE_CHECKING:
    from tenbaud.config.schema import FlightConfig


@dataclass(frozen=True, slots=True)
class MotorOptions:
    """Before the motors of a real rig turn."""

    accept_risk: bool = False
    """Real rig: fly without the soft, input and set-point limits of a first flight."""
    yes: bool = False
    """Real rig: do not ask before its motors turn."""


def confirm_motors(config: FlightConfig, yes: bool) -> None:
    """Ask the person at the terminal, if there is one; anything but y or yes ends the command."""
    from tenbaud.build.first_contact import motor_lines
    from tenbaud.build.rig import real_rig_name
    from tenbaud.flight.outcome import ExitCode

    if yes or not (os.isatty(0) and os.isatty(2)):
        return
    lines = "\n  ".join(motor_lines(config))
    sys.stderr.write(
        f"The motors will turn: {real_rig_name(config.transmitter)}\n  {lines}\n"
        "Is everybody clear of it, and a hand on the emergency stop? Fly? [y/N] "
    )
    sys.stderr.flush()
    if sys.stdin.readline().strip().lower() not in ("y", "yes"):
        typer.echo("tenbaud: not flown; the motors stayed off", err=True)
        raise typer.Exit(int(ExitCode.INTERRUPTED))
