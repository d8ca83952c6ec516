"""Ctrl-C in the middle of every command of the list, the short ones too."""

from __future__ import annotations

import signal
import subprocess
import time
from pathlib import Path

import pytest

from tenbaud.flight.outcome import ExitCode
from tests.tenbaud.endings.commands import (
    ENDS_OF_THEIR_OWN,
    READERS,
    WRITERS,
    Inputs,
    make_inputs,
    nothing_half_is_left,
    processes_with,
)
from tests.tenbaud.processes import finish, start

OFTEN = ("doctor", "inspect", "rig", "rig-check", "view", "design", "convert parquet", "keys init")
COMMANDS = READERS | WRITERS
AFTER_S = (0.0, 0.6)
"""Within its imports, and within its work."""
ATTEMPTS = 5


def _wait_for_main(process: subprocess.Popen[str]) -> None:
    """Wait until Python has started and `main` has begun: it gives SIGINT back to the system first."""
    for wanted in (True, False):
        while process.poll() is None and _catches_sigint(process.pid) is not wanted:
            time.sleep(0.005)


def _interrupted(
    name: str, inputs: Inputs, top: Path, after_s: float
) -> tuple[Path, subprocess.Popen[str]]:
    """Interrupt a command after this time; start it anew where it was over too early for that."""
    for attempt in range(ATTEMPTS):
        folder = top / f"{after_s}-{attempt}"
        folder.mkdir()
        process = start(*COMMANDS[name](inputs, str(folder / "out")), cwd=folder)
        _wait_for_main(process)
        time.sleep(after_s)
        if after_s or process.poll() is None:
            process.send_signal(signal.SIGINT)
            return folder, process
        finish(process)
    raise AssertionError(f"{name} ended {ATTEMPTS} times before it could be interrupted")


def _catches_sigint(pid: int) -> bool:
    lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    (mask,) = [line.split()[1] for line in lines if line.startswith("SigCgt")]
    return bool(int(mask, 16) >> signal.SIGINT - 1 & 1)


@pytest.fixture(scope="module")
def inputs(tmp_path_factory: pytest.TempPathFactory) -> Inputs:
    return make_inputs(tmp_path_factory.mktemp("inputs"))


@pytest.mark.parametrize(
    "name", [pytest.param(one, marks=() if one in OFTEN else pytest.mark.soak) for one in COMMANDS]
)
def test_a_command_that_is_interrupted_leaves_nothing_half(
    name: str, inputs: Inputs, tmp_path: Path
) -> None:
    for after_s in AFTER_S:
        folder, process = _interrupted(name, inputs, tmp_path, after_s)
        ended = finish(process)
        codes = (ExitCode.INTERRUPTED, -signal.SIGINT, 0, ENDS_OF_THEIR_OWN.get(name, 0))
        assert ended.code in codes, (ended.code, ended.err)
        assert "Traceback" not in ended.err, ended.err
        assert processes_with(str(folder)) == []
        nothing_half_is_left(folder)
