"""Commands of a page as copies of a process that has imported what they need.

A page types in a dozen commands, and each would spend most of its time on imports. Here one process has
imported the libraries; a copy of it (`fork`) imports the project as a page's folder has it, and each
command of that page is a copy of this copy. `tenbaud` and `python -c` in that folder are small programs
that ask for a copy, pass it their streams, forward signals, and end as it ended. The long tests and
what `make` starts are ordinary processes.
"""

from __future__ import annotations

import atexit
import ctypes
import gc
import importlib
import json
import os
import select
import signal
import socket
import subprocess
import sys
import tempfile
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any, NoReturn

from tests import warm

LIBRARIES = (
    *("numpy", "scipy.linalg", "scipy.optimize", "scipy.signal", "control", "matplotlib.pyplot"),
    *("numba", "pydantic", "typer", "rich.table", "mcap.reader", "orjson", "zenoh"),
)
PR_SET_PDEATHSIG = 1
PROGRAM = """#!{python} -IS
import json, os, signal, socket, sys

words = sys.argv[1:]
request = {{"arguments": words, "folder": os.getcwd(), "environment": dict(os.environ)}}
if {is_python} and words[:1] != ["-c"]:
    os.execv({python!r}, [{python!r}, *words])
if {is_python}:
    request |= {{"arguments": words[2:], "code": words[1]}}
forwarded = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
signal.pthread_sigmask(signal.SIG_BLOCK, forwarded)
connection = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, {bytes_max})
connection.connect({server!r})
socket.send_fds(connection, [json.dumps(request).encode()], [0, 1, 2])
number = int(connection.recv(64))
for one in forwarded:
    signal.signal(one, lambda which, _: os.killpg(number, which))
signal.pthread_sigmask(signal.SIG_UNBLOCK, forwarded)
code = int(connection.recv(64))
if code < 0:
    signal.signal(-code, signal.SIG_DFL)
    os.kill(os.getpid(), -code)
os._exit(code)
"""


def serve_page(folder: Path, environment: dict[str, str], programs: Path) -> socket.socket:
    """Import the project as it is in a folder, and write `tenbaud` and `python` that copy the result.

    It ends when the connection is closed that this returns.
    """
    server = tempfile.mktemp(prefix="page-", dir=_libraries().parent)  # names of sockets are short
    listener = _listen(server)
    connection = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, warm.REQUEST_BYTES_MAX)
    connection.connect(str(_libraries()))
    request = {"page": True, "folder": str(folder), "environment": environment}
    with open(os.devnull, "rb") as nothing, listener:
        streams = [nothing.fileno(), 2, listener.fileno()]
        socket.send_fds(connection, [json.dumps(request).encode()], streams)
    for name in ("tenbaud", "python", "python3"):
        program = programs / name
        program.write_text(
            PROGRAM.format(
                python=sys.executable,
                is_python=name != "tenbaud",
                bytes_max=warm.REQUEST_BYTES_MAX,
                server=server,
            )
        )
        program.chmod(0o755)
    return connection


@cache
def _libraries() -> Path:
    """Start what has imported the libraries; return where it listens."""
    folder = tempfile.TemporaryDirectory(prefix="tenbaud-")
    place = Path(folder.name) / "server"
    code = f"import sys; sys.path.insert(0, {str(warm.TOP)!r}); from tests.docs import prepared; "
    command = [sys.executable, "-c", f"{code}prepared.main({str(place)!r})", "-" * warm.NAME_BYTES_MAX]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    assert process.stdin is not None
    assert process.stdout is not None
    assert process.stdout.readline(), "what imports the libraries has ended"

    def close() -> None:
        process.stdin.close()  # type: ignore[union-attr]
        process.wait()
        folder.cleanup()

    atexit.register(close)
    return place


def main(place: str) -> None:
    """Import the libraries and make copies until standard input ends."""
    for name in LIBRARIES:
        importlib.import_module(name)
    listener = _listen(place)
    print("ready", flush=True)
    _serve(listener, sys.stdin.fileno())


def _listen(place: str | Path) -> socket.socket:
    listener = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    listener.bind(str(place))
    listener.listen(64)
    return listener


def _serve(listener: socket.socket, until_end_of: int | None = None) -> None:
    """Answer each connection in a copy of its own."""
    gc.freeze()
    watched = [listener, *([] if until_end_of is None else [until_end_of])]
    while True:
        ready, _, _ = select.select(watched, [], [])
        if listener not in ready:
            break
        connection, _ = listener.accept()
        assert len(os.listdir("/proc/self/task")) == 1, "a copy has one thread alone"
        if os.fork() == 0:
            _end_with_parent()
            listener.close()
            _answer(connection)
        connection.close()
        with suppress(ChildProcessError):
            while os.waitpid(-1, os.WNOHANG)[0]:
                pass
    with suppress(ChildProcessError):
        while True:
            os.wait()


def _answer(connection: socket.socket) -> NoReturn:
    """Start what is asked for; end it when the other side has gone, or say how it ended."""
    data, streams, _, _ = socket.recv_fds(connection, warm.REQUEST_BYTES_MAX, 3)
    if not data:
        os._exit(0)
    number = os.fork()
    with suppress(OSError):  # done on both sides: whichever comes first
        os.setpgid(number, number or os.getpid())
    if number == 0:
        _end_with_parent()
        connection.close()
        _begin(json.loads(data), streams)
    for stream in streams:
        os.close(stream)
    with suppress(OSError):
        connection.send(str(number).encode())
    ended = os.pidfd_open(number)
    ready, _, _ = select.select([connection, ended], [], [])
    if ended not in ready:
        os.killpg(number, signal.SIGKILL)
    _, status = os.waitpid(number, 0)
    with suppress(OSError):
        connection.send(str(os.waitstatus_to_exitcode(status)).encode())
    os._exit(0)


def _end_with_parent() -> None:
    """Let the system kill this process when its parent ends: Ctrl-C ends all of a terminal at once."""
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)


def _begin(request: dict[str, Any], streams: list[int]) -> NoReturn:
    """Become the command that was asked for, or what makes the copies of a page."""
    if "page" not in request:
        warm.begin(request, streams)
    os.dup2(streams[0], 0)
    os.dup2(streams[1], 1)
    listener = socket.socket(fileno=streams[2])
    warm.TOP = Path(request["folder"])
    os.chdir(warm.TOP)
    os.environ.clear()
    os.environ.update(request["environment"])
    sys.path[0] = str(warm.TOP)
    warm.load()
    _serve(listener)
    os._exit(0)
