"""Terminals of 40 and 60 columns: nothing is longer than a line, and nothing is folded within words."""

from __future__ import annotations

import fcntl
import os
import pty
import re
import struct
import subprocess
import sys
import termios
from pathlib import Path

import pytest

from tenbaud.cli.app import run
from tenbaud.flight.narrow import broken
from tests.tenbaud.processes import REPOSITORY

ESCAPES = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]")
STUDY = """
name = "a-study-with-a-long-name"
engine = "plain"
set = { duration_s = 1.0 }
grid = { loss = [0.1] }
"""


def shown(columns: int, *words: str, cwd: Path) -> str:
    """Return what a command writes on a terminal of so wide a line, without escapes."""
    master, slave = pty.openpty()
    fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("HHHH", 50, columns, 0, 0))
    environment = {name: value for name, value in os.environ.items() if name != "COLUMNS"}
    environment |= {"TERM": "xterm", "PYTHONPATH": str(REPOSITORY)}
    command = [sys.executable, "-m", "tenbaud", *words]
    process = subprocess.Popen(
        command, stdin=subprocess.DEVNULL, stdout=slave, stderr=slave, cwd=cwd, env=environment
    )
    os.close(slave)
    data = b""
    try:
        while piece := os.read(master, 4096):
            data += piece
    except OSError:  # Linux says so when the last one has closed the other side
        pass
    finally:
        os.close(master)
    assert process.wait(60) == 0, data.decode()
    return ESCAPES.sub("", data.decode())


@pytest.mark.parametrize("columns", [40, 60])
def test_a_flight_and_what_reads_it_keep_to_the_width(columns: int, tmp_path: Path) -> None:
    (tmp_path / "study.toml").write_text(STUDY)
    sweep = ("sweep", "study.toml", "--workers", "1", "--no-plots", "--out", "s")
    outputs = {
        "demo": shown(
            columns, *("demo", "--link", "memory", "--duration", "60", "--out", "run"), cwd=tmp_path
        ),
        "inspect": shown(columns, "inspect", "run", cwd=tmp_path),
        "presets": shown(columns, "presets", cwd=tmp_path),
        "help": shown(columns, "transmit", "--help", cwd=tmp_path),
        "sweep": shown(columns, *sweep, cwd=tmp_path),
    }
    for name, text in outputs.items():
        lines = re.split(r"[\r\n]+", text)
        long = [one for one in lines if len(one.rstrip()) > columns and len(one.split()) > 1]
        assert [one for one in long if not one.endswith("results.parquet")] == [], name
    assert "●" in outputs["demo"], "the gauge is drawn"
    assert "1/1" in outputs["sweep"]
    help_words = outputs["help"].split()
    assert "--accept-risk" in help_words
    assert "<bool>" not in help_words
    assert not [one for one in help_words if "[dim]" in one]


def test_what_is_no_terminal_gets_whole_lines(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "40")
    assert run(["presets"]) == 0
    assert max(map(len, capsys.readouterr().out.splitlines())) > 80


@pytest.mark.parametrize("width", [20, 40])
def test_a_line_is_broken_between_words_and_goes_on_further_in(width: int) -> None:
    line = "  Estimate error  0.46 deg rms, 2.73 deg max (0.36% and 2.13% of the largest)"
    pieces = broken(line, width)
    assert max(map(len, pieces)) <= width
    assert " ".join(" ".join(pieces).split()) == " ".join(line.split())
    assert pieces[0].startswith("  Estimate")
    assert all(one.startswith("     ") for one in pieces[1:])
    assert broken(line, len(line)) == [line]
