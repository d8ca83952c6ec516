"""The command that the rig emulator prints, and the question before motors turn."""

from __future__ import annotations

import json
import os
import pty
import select
import shlex
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.tenbaud.emulated_flight import PATIENT, TENBAUD
from tests.tenbaud.ends import PATIENCE_S

SAFE = (
    *("--set", "transmitter.soft_limits=0.5", "--set", "limits.command_max=1.5"),
    *("--set", "limits.set_point_max=0.16", "--set", "limits.set_point_slew_per_s=0.1"),
)


@pytest.mark.parametrize("arguments", [(), ("--preset", "helicopter-10baud")], ids=["pitch", "three"])
def test_the_printed_command_flies_gently(arguments: tuple[str, ...], tmp_path: Path) -> None:
    command = [*TENBAUD, "rig", "--port", "pty:./rig", "--watchdog", "1", *arguments]
    rig = subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.PIPE, text=True)
    try:
        assert rig.stderr is not None
        printed = [rig.stderr.readline() for _ in range(2)][1]
        words = shlex.split(printed.partition("fly it with: tenbaud ")[2])
        assert words[0] == "demo"
        assert "--yes" in words
        given = (*PATIENT, "--duration", "3", "--json", "--no-figure", "--out", "run")
        flown = subprocess.run(
            [*TENBAUD, *words, *given],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            check=False,
            timeout=PATIENCE_S,
            stdin=subprocess.DEVNULL,
        )
    finally:
        rig.send_signal(signal.SIGINT)
        rig.communicate(timeout=PATIENCE_S)
    assert flown.returncode == 0, flown.stderr
    text = (tmp_path / "run" / "config.toml").read_text()
    assert "soft_limits = " in text
    assert "set_point_slew_per_s = " in text
    summary = json.loads(flown.stdout)
    assert summary["rig"]["writes"] > 0


def answered(answer: str, folder: Path, *options: str) -> tuple[int, str]:
    """Answer the question of `transmit` on a pseudo-terminal; return exit code and what it said."""
    master, slave = pty.openpty()
    command = [*TENBAUD, "transmit", "--rig", "quarc:127.0.0.1:1", *SAFE, *options, "--out", "run"]
    place = ("--listen", "tcp/127.0.0.1:0", "--set", "link.peer_timeout_s=0.1")
    process = subprocess.Popen(
        [*command, *place], cwd=folder, stdin=slave, stdout=subprocess.DEVNULL, stderr=slave
    )
    os.close(slave)
    said = b""
    os.write(master, f"{answer}\n".encode())
    try:
        until = time.monotonic() + PATIENCE_S
        while select.select([master], [], [], max(0.0, until - time.monotonic()))[0]:
            try:
                piece = os.read(master, 4096)
            except OSError:  # Linux says so when the last one has closed the other side
                break
            if not piece:
                break
            said += piece
        return process.wait(max(0.0, until - time.monotonic())), said.decode()
    finally:
        process.kill()
        process.wait(PATIENCE_S)
        os.close(master)


@pytest.mark.skipif(sys.platform == "win32", reason="pseudo-terminals")
@pytest.mark.parametrize("answer", ["", "n", "yes"])
def test_a_person_is_asked_once_with_the_limits(answer: str, tmp_path: Path) -> None:
    code, said = answered(answer, tmp_path)
    assert said.count("Fly? [y/N]") == 1
    for line in (
        "The motors will turn: QUARC model at 127.0.0.1:1",
        "pitch: ends the flight beyond 0.5 rad; set-point within 0.16 rad, at most 0.1 rad/s",
        "front: commands within 1.5 V either way",
    ):
        assert line in said
    asked_on = "at tcp/127.0.0.1:0" in said
    assert asked_on == (answer == "yes")
    if answer != "yes":
        assert code == 130
        assert "not flown; the motors stayed off" in said
        assert not (tmp_path / "run").exists()


def test_yes_skips_the_question(tmp_path: Path) -> None:
    _, said = answered("n", tmp_path, "--yes")
    assert "Fly?" not in said
    assert "at tcp/127.0.0.1:0" in said
