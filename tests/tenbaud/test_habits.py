"""Habits of a command line: units, completion, something on the terminal while a command computes."""

from __future__ import annotations

import io
import os
import pty
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tenbaud.cli import waiting
from tenbaud.cli.app import run
from tenbaud.cli.streams import KeptStream
from tenbaud.cli.units import plain_arguments, plain_setting
from tenbaud.recording.run import Run
from tests.tenbaud.processes import REPOSITORY
from tests.tenbaud.processes import run as run_command


@pytest.mark.parametrize(
    ("given", "plain"),
    [
        (["--mismatch", "7%"], ["--mismatch", "0.07"]),
        (["--mismatch=-10%"], ["--mismatch=-0.1"]),
        (["--duration", "90ms", "--seed", "3"], ["--duration", "0.09", "--seed", "3"]),
        (["--duration", "1.5min"], ["--duration", "90.0"]),
        (["--rate", "20 bit/s"], ["--rate", "20.0"]),
        (["--duration", "1e9999999s"], ["--duration", "1e9999999s"]),
        (["--out", "10%"], ["--out", "10%"]),
        (["--duration", "5", "--", "1e3s"], ["--duration", "5", "--", "1e3s"]),
    ],
)
def test_a_number_may_have_the_unit_of_its_option(given: list[str], plain: list[str]) -> None:
    assert plain_arguments(given) == plain


@pytest.mark.parametrize(
    ("given", "known"),
    [(["--mismatch", "7s"], "7%"), (["--duration=10m"], "10us, 10ms, 10s, 10min, 10h")],
)
def test_when_an_option_has_no_such_unit_then_its_units_are_named(given: list[str], known: str) -> None:
    with pytest.raises(ValueError, match=f"unknown unit; write .* or {known}"):
        plain_arguments(given)


@pytest.mark.parametrize(
    ("field", "text", "plain"),
    [
        ("timing.tick_s", "5ms", "0.005"),
        ("transmitter.plant.mismatch", "-10%", "-0.1"),
        ("model.equilibrium_rad", "90deg", "1.5707963267948966"),
        ("channel.rate_baud", "20 bit/s", "20.0"),
        ("model.damping_per_s", "5s", "5s"),
        ("transmitter.rate_observer_bandwidth_rad_s", "30s", "30s"),
        ("link.session", "5s", "5s"),
        ("coder.window_signs", "3", "3"),
    ],
)
def test_a_setting_may_have_the_unit_of_its_field(field: str, text: str, plain: str) -> None:
    assert plain_setting(field, text) == plain


def test_a_flight_takes_them(tmp_path: Path) -> None:
    units = ("--mismatch", "10%", "--duration", "500ms", "--set", "timing.tick_s=20ms")
    ended = run_command("demo", "--link", "memory", *units, "--out", "run", cwd=tmp_path)
    assert ended.code == 0, ended.err
    config = Run(tmp_path / "run").config
    assert (config.transmitter.plant.mismatch, config.duration_s, config.timing.tick_s) == (
        0.1,
        0.5,
        0.02,
    )


@pytest.mark.parametrize(
    ("typed", "completed"),
    [
        ("tenbaud de", ["demo", "design"]),
        ("tenbaud demo --mism", ["--mismatch"]),
        ("tenbaud demo --preset tu", ["tuned-10baud", "tuned-20baud"]),
        ("tenbaud demo --set coder.w", ["coder.window_signs="]),
    ],
)
def test_a_shell_completes(typed: str, completed: list[str], tmp_path: Path) -> None:
    asked = {
        "COMP_WORDS": typed,
        "COMP_CWORD": str(typed.count(" ")),
        waiting.COMPLETES: "complete_bash",
    }
    ended = run_command(cwd=tmp_path, environment=asked)
    assert ended.out.split() == completed
    assert ended.err == ""


@pytest.mark.parametrize(
    ("typed", "meant"),
    [
        (["dmo"], "demo"),
        (["demo", "--durration", "3"], "--duration"),
        (["demo", "--preset", "tuned-10bad"], "tuned-10baud"),
        (["demo", "--set", "coder.windw_signs=2"], "window_signs"),
        (["demo", "--set", "receiver.pid.output=ptch"], "pitch"),
    ],
)
def test_what_was_meant_is_named(
    typed: list[str], meant: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    assert run(typed) == 2
    assert meant in capsys.readouterr().err


def _read(terminal: int, wanted: str) -> str:
    got = ""
    until = time.monotonic() + 30.0
    while wanted not in got and time.monotonic() < until:
        got += os.read(terminal, 4096).decode()
    return got


def test_a_terminal_shows_that_a_command_works_until_it_says_something(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    ours, theirs = pty.openpty()
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.delenv(waiting.COMPLETES, raising=False)
    try:
        line = waiting.Waiting("tenbaud audit", theirs)
        assert "tenbaud audit: working, 0 s" in _read(ours, "0 s")
        stream = KeptStream(os.fdopen(theirs, "wb", closefd=False))
        stream.before_write = line.end
        stream.write("done")
        stream.flush()
        assert _read(ours, "done").endswith("\r\x1b[Kdone")
    finally:
        os.close(ours)
        os.close(theirs)


def test_elsewhere_nothing_is_shown(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(waiting, "AFTER_S", 0.0)
    with (tmp_path / "file").open("wb") as file:
        waiting.Waiting("tenbaud audit", file.fileno())
        time.sleep(0.05)
    assert (tmp_path / "file").read_bytes() == b""


def test_every_stream_of_a_command_ends_the_line(monkeypatch: pytest.MonkeyPatch) -> None:
    ended: list[str] = []
    monkeypatch.setattr(waiting.Waiting, "end", lambda self: ended.append("end"))
    for name in ("stdout", "stderr"):
        stream = KeptStream(io.BytesIO())
        monkeypatch.setattr(sys, name, stream)
    waiting.begin(["demo"])
    sys.stdout.write("one")
    sys.stderr.write("two")
    assert ended == ["end", "end"]


@pytest.mark.parametrize(("given", "used"), [(None, "1"), ("3", "3")])
def test_a_command_computes_with_one_thread_unless_the_environment_says_otherwise(
    given: str | None, used: str, tmp_path: Path
) -> None:
    code = """
import os
from tenbaud.cli import app
app.run = lambda arguments: print(os.environ["OPENBLAS_NUM_THREADS"]) or 0
app.main()
"""
    environment = {key: value for key, value in os.environ.items() if not key.startswith("OPENBLAS")}
    if given is not None:
        environment["OPENBLAS_NUM_THREADS"] = given
    ended = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path,
        env=environment | {"PYTHONPATH": str(REPOSITORY)},
        capture_output=True,
        text=True,
        check=True,
    )
    assert ended.stdout == f"{used}\n"
