"""Processes that are copies of one that has everything imported (`tests/warm.py`)."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from channel.links.endpoints import free_endpoint
from tenbaud.flight.lifeline import VARIABLE
from tests import warm
from tests.network.namespaces import Lab
from tests.tenbaud.ends import wait_for
from tests.tenbaud.processes import run

TENBAUD = [sys.executable, "-m", "tenbaud"]
pytestmark = pytest.mark.skipif(warm.CLONE is None, reason="copies are made on Linux alone")


def test_a_copy_says_and_does_what_an_ordinary_process_does(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for arguments in (["presets"], ["inspect", "nothing"], ["demo", "--rate", "much"]):
        copied = run(*arguments, cwd=tmp_path, environment={"HOME": str(tmp_path)})
        with monkeypatch.context() as patch:
            patch.setattr(warm.Popen, "server", None)
            assert copied == run(*arguments, cwd=tmp_path, environment={"HOME": str(tmp_path)})
    assert copied.code == 2


def started(folder: Path, *arguments: str, **more: Any) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [*TENBAUD, *arguments], cwd=folder, stderr=subprocess.PIPE, text=True, **more
    )


def test_a_copy_is_a_child_with_a_folder_and_a_session_of_its_own(tmp_path: Path) -> None:
    waiting = ("receive", "--listen", free_endpoint(), "--out", "run")
    with started(
        tmp_path, *waiting, start_new_session=True, env={**os.environ, "ONLY_HERE": "1"}
    ) as process:
        wait_for((tmp_path / "run").is_dir, lambda: "no folder")
        status = Path(f"/proc/{process.pid}/status").read_text()
        assert f"PPid:\t{os.getpid()}\n" in status
        assert os.getsid(process.pid) == process.pid
        words = Path(f"/proc/{process.pid}/cmdline").read_text().rstrip("\0").split("\0")
        assert words == [*TENBAUD, *waiting]
        variables = Path(f"/proc/{process.pid}/environ").read_bytes()
        assert b"ONLY_HERE" not in variables, "an ordinary process has its own"
        process.send_signal(signal.SIGINT)
        assert process.wait(60.0) == 130


def test_what_a_demo_starts_are_its_children_and_they_end_with_it(tmp_path: Path) -> None:
    flying = ("demo", "--clock", "real", "--duration", "600", "--out", "run")
    with started(tmp_path, *flying) as process:
        children = Path(f"/proc/{process.pid}/task/{process.pid}/children")
        wait_for(lambda: len(children.read_text().split()) == 3, lambda: "no two ends")
        ends = [int(one) for one in children.read_text().split()]
        for one in ends:
            variables = Path(f"/proc/{one}/environ").read_bytes()
            assert VARIABLE.encode() not in variables, "only an ordinary process starts with it"
        process.kill()
        wait_for(lambda: not any(map(is_alive, ends)), lambda: "ends are left behind")


def test_a_copy_enters_a_network_namespace_as_the_command_before_it_says(tmp_path: Path) -> None:
    arguments = ("receive", "--listen", free_endpoint(), "--out", "run")
    with Lab() as lab:
        machine = lab.machine("apart")
        with subprocess.Popen([*machine.prefix, *TENBAUD, *arguments], cwd=tmp_path) as process:
            wait_for((tmp_path / "run").is_dir, lambda: "no folder")
            words = Path(f"/proc/{process.pid}/cmdline").read_text().rstrip("\0").split("\0")
            there = Path(f"/proc/{process.pid}/ns/net").stat().st_ino
            process.send_signal(signal.SIGINT)
        assert words == [*TENBAUD, *arguments]
        assert there == (warm.NAMESPACES / machine.name).stat().st_ino
        assert there != Path("/proc/self/ns/net").stat().st_ino


def is_alive(number: int) -> bool:
    try:
        return ") Z " not in Path(f"/proc/{number}/stat").read_text()
    except OSError:
        return False


def test_what_counts_before_the_first_import_starts_an_ordinary_process(tmp_path: Path) -> None:
    code = "import os; os.write(1, b'no copy')"
    (tmp_path / "tenbaud.py").write_text(code)
    environment = {**os.environ, "PYTHONSAFEPATH": "", "PYTHONPATH": str(tmp_path)}
    done = subprocess.run([*TENBAUD], cwd=tmp_path, env=environment, capture_output=True, check=True)
    assert done.stdout == b"no copy"


END = """
import atexit, sys, threading, time
from tests import warm
threading.Thread(target=lambda: (time.sleep(0.2), print("thread"))).start()
atexit.register(print, "exit")
try:
    raise {error}
except BaseException as error:
    warm._end(error)
"""


@pytest.mark.parametrize(
    "error", ["SystemExit", "SystemExit(3)", "SystemExit('why')", "KeyboardInterrupt", "ValueError"]
)
def test_a_copy_ends_as_python_does(error: str) -> None:
    environment = {**os.environ, "PYTHONPATH": str(warm.TOP)}
    code = END.format(error=error)
    ended = [
        subprocess.run([sys.executable, "-c", one], capture_output=True, text=True, env=environment)
        for one in (code, code.replace("warm._end(error)", "raise"))
    ]
    assert ended[0].returncode == ended[1].returncode
    assert ended[0].stdout == ended[1].stdout == "thread\nexit\n"
    assert ended[0].stderr.splitlines()[-1:] == ended[1].stderr.splitlines()[-1:]


def test_when_what_is_copied_has_ended_then_an_ordinary_process_starts_and_then_a_copy(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    server = warm.Server()
    monkeypatch.setattr(warm.Popen, "server", server)
    presets = [*TENBAUD, "presets"]
    made: list[int | None] = []
    start = server.start
    monkeypatch.setattr(server, "start", lambda *given: made.append(start(*given)) or made[-1])
    try:
        subprocess.run(presets, cwd=tmp_path, capture_output=True, check=True)
        assert server._process is not None
        server._process.kill()
        for _ in range(2):
            subprocess.run(presets, cwd=tmp_path, capture_output=True, check=True)
        assert [number is None for number in made] == [False, True, False]
        with monkeypatch.context() as patch:
            patch.setenv("OMP_NUM_THREADS", "7")
            subprocess.run(presets, cwd=tmp_path, capture_output=True, check=True)
        assert made[3:] == [None], "it was not started with that"
        subprocess.run(presets, cwd=tmp_path, capture_output=True, check=True, process_group=0)
        assert len(made) == 4
    finally:
        server.close()
