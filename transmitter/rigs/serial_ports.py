"""Lists this machine's serial ports, and whether this user may open them."""

from __future__ import annotations

import os
import stat
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class PortNote:
    """One serial port."""

    device: str
    description: str
    usable: bool
    remedy: str
    """what to do where it is not usable"""


def list_ports() -> list[PortNote]:
    """Return the ports that the operating system knows, those of real hardware first."""
    from serial.tools import list_ports as tools

    notes = []
    for port in sorted(tools.comports(), key=lambda one: (one.vid is None, one.device)):
        if port.vid is None and port.description == "n/a" and port.device.startswith("/dev/ttyS"):
            continue  # Linux lists these on every PC, mostly without a plug behind them
        text = port.description if port.description != "n/a" else "no description"
        if port.vid is not None:
            text += f", USB {port.vid:04x}:{port.pid:04x}"
        usable, remedy = _access(port.device)
        notes.append(PortNote(port.device, text, usable, remedy))
    return notes


def _access(device: str) -> tuple[bool, str]:
    if os.name != "posix" or os.access(device, os.R_OK | os.W_OK):
        return True, ""
    try:
        mode = os.stat(device)
    except OSError as error:
        return False, f"it vanished: {error.strerror}"
    import grp

    try:
        group = grp.getgrgid(mode.st_gid).gr_name
    except KeyError:
        group = str(mode.st_gid)
    if mode.st_mode & stat.S_IRGRP and mode.st_mode & stat.S_IWGRP:
        return False, f"add yourself to its group (sudo usermod -aG {group} $USER) and log in again"
    return False, "neither you nor your groups may open it"
