"""The page's process beside a demonstration: it ends with its parent, whatever ends that."""

from __future__ import annotations

import contextlib
import signal
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from benchmarks.browser import served
from tenbaud.view.server import Address
from tests.tenbaud.processes import finish, start
from tests.tenbaud.view.viewers import beside, is_free, needs_page

pytestmark = [
    needs_page,
    pytest.mark.skipif(not Path("/proc").is_dir(), reason="finds processes in /proc"),
]

MOMENTS_S = (0.05, 0.3, 0.7, 1.5)


def _children(parent: int) -> list[int]:
    found = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            fields = path.read_text(errors="replace").rpartition(")")[2].split()
            if int(fields[1]) == parent:
                found.append(int(path.parent.name))
    return found


def _is_alive(pid: int) -> bool:
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state != "Z"  # nobody here may wait for another's child


def wait_until(true: Callable[[], object], what: str, timeout_s: float = 60.0) -> None:
    until_s = time.monotonic() + timeout_s
    while not true():
        assert time.monotonic() < until_s, what
        time.sleep(0.02)


@pytest.mark.parametrize("moment_s", MOMENTS_S)
def test_ctrl_c_at_any_moment_ends_the_viewer_and_frees_its_port(
    tmp_path: Path, moment_s: float
) -> None:
    port = Address(port=0).checked().port
    process = start("demo", "--view", "--view-port", str(port), "--out", "run", cwd=tmp_path)
    time.sleep(moment_s)
    process.send_signal(signal.SIGINT)
    ended = finish(process, 60.0)
    assert ended.code != 0
    assert beside(port) == []
    assert is_free(port)


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGKILL])
def test_a_signal_while_the_page_is_starting_ends_its_process(
    tmp_path: Path, how: signal.Signals
) -> None:
    port = Address(port=0).checked().port
    # A folder of its own for what is temporary; a short one, for there will be sockets in it.
    with tempfile.TemporaryDirectory(prefix="tb") as own:
        arguments = ("demo", "--view", "--view-port", str(port), "--out", "run")
        process = start(*arguments, cwd=tmp_path, environment={"TMPDIR": own})
        wait_until(lambda: beside(port), "the page's process was never started")
        process.send_signal(how)
        ended = finish(process, 60.0)
        assert "tenbaud view: " not in ended.err
        assert "Traceback" not in ended.err
        # One that was killed can wait for nobody: its children notice by themselves.
        wait_until(lambda: not beside(port) and is_free(port), "the page's process is left behind")
        if how != signal.SIGKILL:
            assert list(Path(own).glob("tenbaud-view-*")) == []


def test_when_the_demonstration_is_killed_then_all_its_processes_end(tmp_path: Path) -> None:
    arguments = ("demo", "--view", "--view-port", "0", "--duration", "600", "--out", "run")
    with served(tmp_path, *arguments) as flight:
        wait_until(lambda: len(_children(flight.process.pid)) == 3, "no flight")
        children = _children(flight.process.pid)
        flight.process.kill()
        flight.process.wait()
        wait_until(lambda: not any(map(_is_alive, children)), "children are left behind")
        assert is_free(flight.port)
