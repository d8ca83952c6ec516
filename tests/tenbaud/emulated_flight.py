"""A flight of real processes: an emulated rig, and both ends of the demo."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tests.tenbaud.confirmed import PATIENT as NO_WATCHDOG
from tests.tenbaud.ends import PATIENCE_S

TENBAUD = [sys.executable, "-m", "tenbaud"]
PATIENT = ["--set", "transmitter.bridge.stale_s=1.0", *NO_WATCHDOG]
"""The tests share the machine with others; what is stale on a quiet one is too strict here."""


class RigProcess:
    """`tenbaud rig` as a user starts it."""

    def __init__(self, form: str, *arguments: str) -> None:
        command = [*TENBAUD, "rig", "--format", form, "--json", *arguments]
        self.process = subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
        )
        assert self.process.stdout is not None
        self.address: str = json.loads(self.process.stdout.readline())["port"]

    def end(self) -> dict[str, Any]:
        """Stop it; return what the device saw."""
        self.process.send_signal(signal.SIGINT)
        out, _ = self.process.communicate(timeout=PATIENCE_S)
        figures: dict[str, Any] = json.loads(out)
        return figures


@dataclass
class Flown:
    """What came of a flight, on both sides of the bridge."""

    code: int
    summary: dict[str, Any]
    device: dict[str, Any]
    said: str


def fly_emulated(
    form: str,
    folder: Path,
    *,
    seconds: float,
    rig_arguments: tuple[str, ...] = (),
    arguments: tuple[str, ...] = (),
) -> Flown:
    rig = RigProcess(form, "--mismatch", "0.1", "--watchdog", "1", *rig_arguments)
    serial_over_tcp = form != "quarc" and not rig.address.startswith("/")
    try:
        result = demo(
            "--clock",
            "real",
            "--rig",
            f"{form}:{'socket://' if serial_over_tcp else ''}{rig.address}",
            "--preset",
            "paper-10baud",
            *PATIENT,
            *arguments,
            seconds=seconds,
            out=folder,
        )
    finally:
        device = rig.end()
    return Flown(result.returncode, json.loads(result.stdout), device, result.stderr)


def demo(*arguments: str, seconds: float, out: Path) -> subprocess.CompletedProcess[str]:
    command = [*TENBAUD, "demo", "--json", "--duration", f"{seconds:g}", "--out", str(out)]
    command += ["--set", "coder.window_signs=3", *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=PATIENCE_S)
