"""Commands of a page as copies of a process that has imported what they need.

A page types in a dozen commands, and each would spend most of its time on imports. Here one process has
imported the libraries and the project, from a folder of which each page has a copy; a copy of the
process (`fork`) belongs to a page, and each command of that page is a copy of this copy. `tenbaud` and
`python -c` in the page's folder are small programs that ask for a copy, pass it their streams, forward
signals, and end as it ended. The long tests and what `make` starts are ordinary processes.
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
from tests.docs.repository import Ports, copy_repository

LIBRARIES = (
    *("numpy", "scipy.linalg", "scipy.optimize", "scipy.signal", "control", "matplotlib.pyplot"),
    *("numba", "pydantic", "typer", "rich.table", "mcap.reader", "orjson", "zenoh", "pandas"),
)
AS_TYPED = {"COLUMNS": "200", "NO_COLOR": "1"}
"""What a page's commands find in their environment, and some libraries read when they are imported."""
ONE_THREAD = {"JE_ARROW_MALLOC_CONF": "background_thread:false"}
"""What keeps a library of pandas from starting a thread when it is imported."""
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
    """Begin what makes the copies in a folder, and write `tenbaud` and `python` that ask for them.

    It ends when the connection is closed that this returns.
    """
    imported, _ = _imported()
    server = tempfile.mktemp(prefix="page-", dir=imported.parent)  # names of sockets are short
    listener = _listen(server)
    connection = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, warm.REQUEST_BYTES_MAX)
    connection.connect(str(imported))
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


def copy_imported(folder: Path) -> Ports:
    """Copy the repository as it is imported into a new folder; return the ports exchanged in it."""
    listens, ports = _imported()
    subprocess.run(["cp", "-a", listens.parent / "repository", folder], check=True)
    return ports


@cache
def _imported() -> tuple[Path, Ports]:
    """Start what has imported everything; return where it listens, and its ports."""
    folder = tempfile.TemporaryDirectory(prefix="tenbaud-")
    repository, place, ports = Path(folder.name) / "repository", Path(folder.name) / "server", Ports()
    copy_repository(repository, ports, short=True)
    code = f"import sys; sys.path.insert(0, {str(warm.TOP)!r}); from tests.docs import prepared; "
    code += f"prepared.main({str(place)!r}, {str(repository)!r})"
    process = subprocess.Popen(
        [sys.executable, "-c", code, "-" * warm.NAME_BYTES_MAX],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        env=os.environ | AS_TYPED | ONE_THREAD,
    )
    assert process.stdin is not None
    assert process.stdout is not None
    assert process.stdout.readline(), "what imports everything has ended"

    def close() -> None:
        process.stdin.close()  # type: ignore[union-attr]
        process.wait()
        folder.cleanup()

    atexit.register(close)
    return place, ports


def main(place: str, repository: str) -> None:
    """Import everything and make copies until standard input ends."""
    sys.path[0] = repository
    for name in LIBRARIES:
        importlib.import_module(name)
    warm.load()
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
    _serve(listener)
    os._exit(0)
