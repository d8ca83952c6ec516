"""The service units are ones that systemd takes, and start commands that exist."""

from __future__ import annotations

import configparser
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from tenbaud.cli.commands import app
from tests.tenbaud.processes import REPOSITORY

UNITS = sorted((REPOSITORY / "deploy").glob("*.service"))
COMMAND = "/opt/tenbaud/bin/tenbaud"


def section(unit: Path, name: str) -> dict[str, str]:
    parser = configparser.ConfigParser(interpolation=None, strict=True)
    parser.optionxform = str  # type: ignore[method-assign,assignment]
    parser.read_string(unit.read_text())
    return dict(parser[name])


def options_of(unit: Path) -> list[str]:
    """Return the options in the configuration file that the unit reads."""
    name = Path(section(unit, "Service")["EnvironmentFile"]).name
    (line,) = [
        line
        for line in (unit.parent / name).read_text().splitlines()
        if line.startswith("TENBAUD_OPTIONS=")
    ]
    return shlex.split(line.partition("=")[2])


def test_there_is_a_unit_for_each_process() -> None:
    assert [unit.stem for unit in UNITS] == ["tenbaud-receive", "tenbaud-router", "tenbaud-transmit"]


@pytest.mark.parametrize("unit", UNITS, ids=lambda unit: unit.stem)
def test_systemd_takes_the_unit(unit: Path, tmp_path: Path) -> None:
    if shutil.which("systemd-analyze") is None:
        pytest.skip("no systemd-analyze here; the unit is parsed by the other tests")
    # The command is not installed here; systemd wants to see a program.
    copy = tmp_path / unit.name
    copy.write_text(unit.read_text().replace(COMMAND, sys.executable))
    done = subprocess.run(
        ["systemd-analyze", "verify", str(copy)], capture_output=True, text=True, check=False
    )
    own = [line for line in done.stderr.splitlines() if unit.name in line]
    assert (done.returncode, own) == (0, [])


@pytest.mark.parametrize("unit", UNITS, ids=lambda unit: unit.stem)
def test_the_unit_starts_a_command_with_options_that_exist(unit: Path) -> None:
    program, verb, *fixed, last = shlex.split(section(unit, "Service")["ExecStart"])
    assert (program, last) == (COMMAND, "$TENBAUD_OPTIONS")
    # Whatever cannot be parsed ends with code 2 before anything is opened; here the keys are missing.
    ended = CliRunner().invoke(app, [verb, *fixed, *options_of(unit)])
    assert "Usage" not in ended.output, ended.output
    assert "/etc/tenbaud/keys" in str(ended.exception)


def test_a_real_rig_is_not_started_again_by_itself() -> None:
    (transmit,) = [unit for unit in UNITS if unit.stem.endswith("transmit")]
    assert section(transmit, "Service")["Restart"] == "no"
    assert "[Install]" not in transmit.read_text()
