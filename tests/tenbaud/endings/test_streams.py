"""Standard streams that are full, closed or gone: nothing stops, and nothing is lost in silence."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tenbaud.flight.outcome import ExitCode
from tests.tenbaud.endings.commands import READERS, SHORT, WRITERS, Arguments, Inputs, make_inputs
from tests.tenbaud.processes import REPOSITORY

pytestmark = pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")

FLIGHT: Arguments = lambda _, out: ["demo", "--link", "memory", *SHORT, "--json", "--out", out]  # noqa: E731
TALKERS = {"demo --json": FLIGHT, **WRITERS, **READERS}
SILENT = {"transmit": ExitCode.LINK_LOST, "receive": ExitCode.LINK_LOST, "rig-check": ExitCode.USAGE}
"""Commands that say nothing on standard output in these forms, and how they end."""
ORDINARY = ("demo --json", "inspect")


@pytest.fixture(scope="module")
def inputs(tmp_path_factory: pytest.TempPathFactory) -> Inputs:
    return make_inputs(tmp_path_factory.mktemp("inputs"))


FORMS = [
    pytest.param(name, id=name, marks=() if name in ORDINARY else pytest.mark.soak) for name in TALKERS
]


def _run(name: str, redirections: str, inputs: Inputs, folder: Path) -> tuple[int, str, str]:
    """Run a command with its streams redirected by a shell; return code, output and messages."""
    arguments = TALKERS[name](inputs, str(folder / "out"))
    path = os.pathsep.join([str(REPOSITORY), os.environ.get("PYTHONPATH", "")])
    done = subprocess.run(
        ["sh", "-c", f'exec "$@" {redirections}', "sh", sys.executable, "-m", "tenbaud", *arguments],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": path, "COLUMNS": "200"},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert "Traceback" not in done.stderr, done.stderr
    assert "Exception" not in done.stderr, done.stderr
    return done.returncode, done.stdout, done.stderr


def _ends_well(name: str) -> int:
    """Return the exit code that a command has with streams as usual."""
    return int(SILENT.get(name, 0))


@pytest.mark.parametrize("name", FORMS)
def test_output_that_is_lost_is_said(name: str, inputs: Inputs, tmp_path: Path) -> None:
    code, _, err = _run(name, ">/dev/full", inputs, tmp_path)
    # This machine may have problems, which `doctor` says with a code of its own.
    if name != "doctor" or code != ExitCode.FAILED:
        assert code == (_ends_well(name) or ExitCode.NOT_WRITTEN), err
    if name not in SILENT:
        assert "standard output cannot be written: No space left on device" in err


@pytest.mark.parametrize("name", FORMS)
def test_a_reader_that_went_away_is_said(name: str, inputs: Inputs, tmp_path: Path) -> None:
    code, _, err = _run(name, "| true; exit $?", inputs, tmp_path)
    assert code == 0  # that of `true`
    if name not in SILENT and name != "presets":
        assert "standard output cannot be written: Broken pipe" in err


CLOSED = (">&- 2>&- <&-", ">&-", "2>&-", "2>/dev/full")
EACH_CLOSED = [
    pytest.param(
        name,
        redirections,
        id=f"{name}-{redirections}",
        marks=()
        if name == ORDINARY[0] or (name, redirections) == (ORDINARY[1], CLOSED[0])
        else pytest.mark.soak,
    )
    for name in TALKERS
    for redirections in CLOSED
]
"""The flight with each, a short command with all that can be closed; the others under `make soak`."""


@pytest.mark.parametrize(("name", "redirections"), EACH_CLOSED)
def test_closed_streams_change_nothing(
    name: str, redirections: str, inputs: Inputs, tmp_path: Path
) -> None:
    code, out, _ = _run(name, redirections, inputs, tmp_path)
    if name == "doctor":
        return
    assert code == _ends_well(name)
    if name == "demo --json":
        for recording in (tmp_path / "out").glob("*.mcap"):
            assert recording.read_bytes()[:5] == b"\x89MCAP", "something was printed into it"
        if ">&-" not in redirections.replace("2>&-", ""):
            assert json.loads(out)["exit_code"] == 0
