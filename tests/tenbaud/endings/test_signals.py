"""Signals at every stage of a command, and children that are killed."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tenbaud.build.flight import agree
from tenbaud.cli.app import run
from tenbaud.config.load import load_config
from tenbaud.flight import demo
from tenbaud.flight.outcome import ExitCode, outcome_of_status
from tenbaud.recording.folder import RunFolder
from tests.tenbaud.endings.commands import nothing_half_is_left, processes_with
from tests.tenbaud.processes import REPOSITORY, Ended, finish, start

SIGNALS = [signal.SIGINT, signal.SIGTERM, signal.SIGHUP]
PATIENCE_S = 240.0
FLIGHT = ("demo", "--clock", "real", "--duration", "60", "--mismatch", "0", "--out", "run")


def _wait_for(met: Callable[[], bool]) -> None:
    until = time.monotonic() + PATIENCE_S
    while not met():
        assert time.monotonic() < until
        time.sleep(0.02)


def _flies(folder: Path) -> bool:
    recording = folder / "run" / "transmitter.mcap"
    return recording.is_file() and recording.stat().st_size > 20_000


STAGES: dict[str, Callable[[Path], bool]] = {
    "at once": lambda _: True,
    "first moments": lambda folder: (folder / "run").exists(),
    "in flight": _flies,
}


def _stopped(ended: Ended, number: int) -> None:
    """Assert that a command ended by a signal, in its own way or in the system's."""
    assert ended.code in (ExitCode.INTERRUPTED, -number), (ended.code, ended.err)
    _without_traceback(ended)


def _without_traceback(ended: Ended) -> None:
    # Python's own start cannot be covered: until `main` it prints where it was interrupted.
    assert "Traceback" not in ended.err or ", in main" not in ended.err, ended.err


def test_when_an_interrupt_passed_an_import_that_executes_text_then_the_code_is_the_commands(
    tmp_path: Path,
) -> None:
    code = """
from contextlib import suppress
with suppress(KeyboardInterrupt):
    exec("raise KeyboardInterrupt")
from tenbaud.cli.streams import leave
leave(130)
"""
    assert finish(start(cwd=tmp_path, code=code)).code == ExitCode.INTERRUPTED


def test_when_an_interrupt_comes_out_of_an_import_as_another_error_then_the_command_is_interrupted(
    tmp_path: Path,
) -> None:
    code = """
import sys
from tenbaud.cli import app, commands
class Interrupted:
    def __set_name__(self, owner, name):
        raise KeyboardInterrupt
commands.app_for = lambda arguments: type("Imported", (), {"field": Interrupted()})
sys.exit(app.run([]))
"""
    ended = finish(start(cwd=tmp_path, code=code))
    assert (ended.code, ended.err) == (ExitCode.INTERRUPTED, "")


@pytest.mark.parametrize(
    ("stage", "number"),
    [
        pytest.param(
            stage,
            number,
            id=f"{stage}-{number.name}",
            marks=() if (stage, number) in zip(STAGES, SIGNALS, strict=True) else pytest.mark.soak,
        )
        for stage in STAGES
        for number in SIGNALS
    ],
)
def test_a_demo_ends_with_all_its_processes(stage: str, number: int, tmp_path: Path) -> None:
    process = start(*FLIGHT, "--figure", cwd=tmp_path)
    time.sleep(0.15)
    _wait_for(lambda: STAGES[stage](tmp_path))
    process.send_signal(number)
    ended = finish(process)
    _stopped(ended, number)
    assert processes_with(str(tmp_path)) == []
    if (tmp_path / "run").exists():
        nothing_half_is_left(tmp_path)
    if stage == "in flight":
        summary = json.loads((tmp_path / "run" / "summary.json").read_text())
        assert summary["exit_code"] == ExitCode.INTERRUPTED
        assert (tmp_path / "run" / "flight.png").stat().st_size > 1000


LASTING: dict[str, tuple[str, ...]] = {
    "transmit": ("transmit", "--listen", "tcp/127.0.0.1:0", "--out", "run"),
    "receive": ("receive", "--listen", "tcp/127.0.0.1:0", "--out", "run"),
    "receive --sessions": ("receive", "--sessions", "*", "--listen", "tcp/127.0.0.1:0", "--out", "run"),
    "rig": ("rig", "--port", "pty:port"),
    "rig-check": (
        *("rig-check", "--rig", "quarc-server:0", "--seconds", "60"),
        *("--set", "transmitter.bridge.first_sample_timeout_s=60"),
    ),
    "view": ("view", "--port", "0"),
    "router": ("router", "--listen", "tcp/127.0.0.1:0"),
    "view RUN": ("view", str(REPOSITORY / "tests/golden/recordings/two-epochs-0.1.0"), "--port", "0"),
    "identify": ("identify", "--duration", "20000", "--out", "run"),
    "figures": ("figures", "all", "--out", "run"),
    "tune": ("tune", "--disturbance", "q=2e-3", "--out", "found.toml", "--evaluations", "100000"),
    "sweep": ("sweep", "study.toml", "--workers", "2", "--out", "run"),
}
STUDY = 'name = "long"\nseeds = 2000\nset = { duration_s = 1000.0 }\ngrid = { loss = [0.0, 0.1] }\n'
WHEN_IT_WAITS = ("transmit", "receive", "rig", "rig-check", "view", "view RUN")


@pytest.mark.parametrize("number", SIGNALS, ids=lambda one: one.name)
@pytest.mark.parametrize("after_s", [0.2, pytest.param(2.5, marks=pytest.mark.soak)])
@pytest.mark.parametrize(
    "name",
    [pytest.param(one, marks=() if one in WHEN_IT_WAITS else pytest.mark.soak) for one in LASTING],
)
def test_a_lasting_command_ends(name: str, after_s: float, number: int, tmp_path: Path) -> None:
    if name in ("transmit", "receive", "rig") and number is not signal.SIGTERM and after_s < 1.0:
        pytest.skip("covered by the demo, which starts them")
    (tmp_path / "study.toml").write_text(STUDY)
    process = start(*LASTING[name], cwd=tmp_path)
    time.sleep(after_s)
    process.send_signal(number)
    ended = finish(process)
    # A rig and a router end with 0 in the ordinary way. Interrupted in an `exec` of a text, as when a
    # dataclass is made, Python 3.11 dies of SIGINT after all, which a shell calls 130 too.
    codes = (ExitCode.INTERRUPTED, -number, -signal.SIGINT, 0)
    assert ended.code in codes, (ended.code, ended.err)
    _without_traceback(ended)
    nothing_half_is_left(tmp_path)
    assert not (tmp_path / "port").is_symlink(), "its port is left"


@pytest.mark.parametrize("command", ["transmit", "receive", "demo --view"])
def test_what_is_interrupted_before_its_flight_leaves_no_folder(command: str, tmp_path: Path) -> None:
    view = ("--view", "--view-port", "0") if "view" in command else ("--listen", "tcp/127.0.0.1:0")
    process = start(command.split()[0], *view, "--out", "run", cwd=tmp_path)
    _wait_for(lambda: (tmp_path / "run" / "config.toml").is_file() or process.poll() is not None)
    process.send_signal(signal.SIGINT)
    ended = finish(process)
    assert ended.code == ExitCode.INTERRUPTED, ended.err
    assert "interrupted" in ended.err or "stopped" in ended.err
    assert processes_with(str(tmp_path)) == []
    assert not (tmp_path / "run").exists()


WRONG = "/dev/tenbaud-is-not-here"
NO_PORT: dict[str, tuple[str, ...]] = {
    "demo with a rig": ("demo", "--clock", "real", "--rig", f"cobs:{WRONG}"),
    "transmit with a rig": ("transmit", "--rig", f"cobs:{WRONG}"),
    "transmit with a rig's second port": (
        *("transmit", "--rig", "cobs:/dev/null", "--set", f"transmitter.serial.motor_port={WRONG}"),
    ),
    "rig-check": ("rig-check", "--rig", f"cobs:{WRONG}"),
    "rig": ("rig", "--port", WRONG),
    "transmit": ("transmit", "--link", "serial", "--port", WRONG),
    "receive": ("receive", "--link", "serial", "--port", WRONG),
    "receive, second port": (
        *("receive", "--link", "serial", "--port", "/dev/null", "--downlink", WRONG),
    ),
}


@pytest.mark.parametrize("name", NO_PORT)
def test_a_port_that_is_not_there_is_refused_before_anything_starts(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(subprocess, "Popen", None)
    out = () if name.startswith("rig") else ("--out", str(tmp_path / "run"))
    assert run([*NO_PORT[name], *out]) == ExitCode.USAGE
    said = capsys.readouterr().err
    assert said.startswith(f"tenbaud: {WRONG} cannot be opened: No such file or directory; ")
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize("sessions", [(), ("--sessions", "rig/*", "--flights", "1")])
def test_a_receiver_does_not_need_the_port_of_the_rig(
    sessions: tuple[str, ...], tmp_path: Path
) -> None:
    place = ("--listen", "tcp/127.0.0.1:0", "--set", "link.peer_timeout_s=1")
    process = start(
        "receive", "--rig", f"cobs:{WRONG}", *sessions, *place, "--out", "run", cwd=tmp_path
    )
    if sessions:
        _wait_for(lambda: (tmp_path / "run").exists() or process.poll() is not None)
        process.send_signal(signal.SIGINT)
    ended = finish(process)
    assert WRONG not in ended.err
    expected = (ExitCode.OK, ExitCode.INTERRUPTED) if sessions else (ExitCode.LINK_LOST,)
    assert ended.code in expected, ended.err


def test_an_end_that_cannot_begin_takes_the_waiting_one_with_it(tmp_path: Path) -> None:
    # No serial port, but something that is there: found out by the transmitter alone.
    started = time.monotonic()
    rig = ("--clock", "real", "--rig", f"cobs:{tmp_path}")
    ended = finish(
        start("demo", *rig, "--set", "link.peer_timeout_s=200", "--out", "run", cwd=tmp_path)
    )
    assert time.monotonic() - started < 100.0
    assert ended.code == ExitCode.USAGE
    assert f"{tmp_path} cannot be opened" in ended.err
    assert "interrupted" not in ended.err
    assert ended.out == ""
    assert not (tmp_path / "run").exists()


def test_nohup_is_respected(tmp_path: Path) -> None:
    code = "import signal; signal.signal(signal.SIGHUP, signal.SIG_IGN)\n"
    code += "from tenbaud.cli.app import main; main()"
    process = start(*FLIGHT, cwd=tmp_path, code=code)
    _wait_for(lambda: _flies(tmp_path))
    process.send_signal(signal.SIGHUP)
    time.sleep(0.5)
    assert process.poll() is None
    process.send_signal(signal.SIGTERM)
    assert finish(process).code == ExitCode.INTERRUPTED


class _Killer:
    """Sends a signal to one end of a demo once its transmitter has flown so far."""

    def __init__(self, role: str, at_s: float, *numbers: int) -> None:
        self.role, self.at_s, self.numbers = role, at_s, list(numbers)
        self.ends: dict[str, Any] = {}
        self.at_end: list[int] = []

    def on_status(self, status: dict[str, Any]) -> None:
        if status["role"] == "transmitter" and (status["time_s"] or 0.0) >= self.at_s and self.numbers:
            os.kill(self.ends[self.role].process.pid, self.numbers.pop(0))


def _fly(
    folder: Path,
    killer: _Killer,
    monkeypatch: pytest.MonkeyPatch,
    duration_s: float,
    watchdog_s: float = 0.5,
) -> demo.DemoResult:
    made = demo._Child

    def remembered(role: str, *rest: Any) -> Any:
        killer.ends[role] = made(role, *rest)  # type: ignore[arg-type]
        return killer.ends[role]

    monkeypatch.setattr(demo, "_Child", remembered)
    settings = {
        "duration_s": duration_s,
        "link": {"peer_timeout_s": 2.0},
        "transmitter": {"watchdog_s": watchdog_s},
    }
    agreement = agree(load_config(None, None, settings), "real")
    folder.mkdir()
    return demo.fly_demo(agreement, RunFolder(folder), killer.on_status)


@pytest.mark.parametrize("role", ["transmitter", "receiver"])
def test_an_end_that_is_killed_in_flight_is_the_cause_that_is_named(
    role: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    killer = _Killer(role, 1.0, signal.SIGKILL)
    result = _fly(tmp_path / "run", killer, monkeypatch, 6.0)
    assert result.code == ExitCode.LINK_LOST
    assert result.messages[-1] == f"the {role} was killed by SIGKILL"
    written = json.loads((tmp_path / "run" / "summary.json").read_text())
    assert written["outcome"] == f"the {role} was killed by SIGKILL"
    assert written["exit_code"] == ExitCode.LINK_LOST
    nothing_half_is_left(tmp_path)


def test_a_receiver_that_dies_late_does_not_cost_the_summary(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Stopped in the last second it cannot end; it is killed when the transmitter has ended.
    killer = _Killer("receiver", 2.0, signal.SIGSTOP)
    waited = demo._wait

    def wait(ends: Any, stop: Any) -> None:
        ends[0].process.wait(PATIENCE_S)
        ends[1].process.kill()
        waited(ends, stop)

    monkeypatch.setattr(demo, "_wait", wait)
    result = _fly(tmp_path / "run", killer, monkeypatch, 3.0, watchdog_s=30.0)
    assert result.messages[-1] == "the receiver was killed by SIGKILL"
    assert result.code in (ExitCode.FAILED, ExitCode.LINK_LOST)
    written = json.loads((tmp_path / "run" / "summary.json").read_text())
    assert written["digest_checks"] >= 18
    assert written["exit_code"] == result.code


@pytest.mark.parametrize(
    ("status", "code", "text"),
    [
        (0, ExitCode.OK, "the flight is over"),
        (-9, ExitCode.FAILED, "the receiver was killed by SIGKILL"),
        (-11, ExitCode.FAILED, "the receiver was killed by SIGSEGV"),
        (-64, ExitCode.FAILED, "the receiver was killed by SIGRTMAX"),
        (-63, ExitCode.FAILED, "the receiver was killed by signal 63"),
        (4, ExitCode.LINK_LOST, "the receiver ended with exit code 4"),
        (120, ExitCode.FAILED, "the receiver ended with exit code 120"),
    ],
)
def test_every_exit_status_is_an_outcome(status: int, code: ExitCode, text: str) -> None:
    outcome = outcome_of_status("receiver", status)
    assert (outcome.code, outcome.text) == (code, text)
