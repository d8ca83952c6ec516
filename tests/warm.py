"""Processes of `tenbaud` that start with everything imported.

Most of a short flight is the start of its processes: each imports the same six hundred modules. Here a
process is a copy (`fork`) of one that has imported them and has done nothing else: with streams,
environment, folder, network namespace and session of its own, and a child of the one that asked for it.
What serves a page also finds the page's libraries imported. What is said about starting, ending or
finding processes is tested with ordinary ones, and so is what a shell starts; the commands of the
documentation are copies of their own kind (`tests/docs/prepared.py`).

A process that starts others, as `tenbaud demo` does, keeps an untouched copy of itself for that.
"""

from __future__ import annotations

import atexit
import ctypes
import gc
import importlib
import io
import json
import os
import platform
import signal
import socket
import subprocess
import sys
import threading
import traceback
import types
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any, NoReturn

TOP = Path(__file__).parents[1]
IMPORTED = (
    *("tenbaud.cli.commands", "tenbaud.cli.nodes", "tenbaud.cli.demo", "tenbaud.flight.demo"),
    *("tenbaud.flight.transmit", "tenbaud.flight.receive", "tenbaud.flight.fly", "tenbaud.build.ends"),
    *("tenbaud.flight.screen", "channel.links.zenoh.link", "zenoh", "numpy"),
    *("scipy.linalg", "scipy.optimize"),
)
PAGE = (
    *("nicegui", "uvicorn", "uvicorn.protocols.websockets.wsproto_impl", "anyio._backends._asyncio"),
    *("tenbaud.view.page", "tenbaud.view.server", "tenbaud.view.gate", "tenbaud.view.replay"),
)
"""Imported before the first copy that serves a page; most workers of a run make none."""
SERVES_PAGE = ("view", "--view")
STARTS_OTHERS = ("demo", "figures")
CLONE = {"x86_64": 56, "aarch64": 220}.get(platform.machine()) if sys.platform == "linux" else None
"""The number of the system call that makes a copy."""
CLONE_PARENT = 0x8000
CLONE_NEWNET = 0x40000000
IN_NAMESPACE = ["ip", "netns", "exec"]
NAMESPACES = Path("/run/netns")
REQUEST_BYTES_MAX = 1 << 20
NAME_BYTES_MAX = 4096
READ_AT_START = ("PYTHON", "LANG", "LC_", "OMP_", "OPENBLAS_")
"""Variables of these names count before anything is imported: a copy has those of its original."""
ALIKE = {"PYTHONPATH": None, "PYTHONIOENCODING": "utf-8"}
"""But not these: a copy looks where the first says, and its streams are in UTF-8."""


class Popen(subprocess.Popen):  # type: ignore[type-arg]
    """What starts `python -m tenbaud` as a copy where that is possible, and all else as always."""

    server: Server | None = None

    def _execute_child(self, args: Any, executable: Any, preexec_fn: Any, *rest: Any) -> None:
        close_fds, pass_fds, cwd, env, _, _, shell = rest[:7]
        pipes, (_, gid, gids, uid, umask, own_session, group) = rest[7:13], rest[13:20]
        plain = not (shell or preexec_fn or pass_fds or executable) and close_fds
        plain = plain and (gid, gids, uid, umask, group) == (None, None, None, -1, -1)
        words = [os.fsdecode(one) for one in args] if plain and not isinstance(args, str) else []
        environment = dict(os.environ if env is None else env)
        folder = os.fsdecode(cwd or os.getcwd())
        namespace = words[3] if words[:3] == IN_NAMESPACE else None
        words = words[4:] if namespace else words
        copied = words[:3] == [sys.executable, "-m", "tenbaud"] and _is_same(folder, environment)
        request = {
            "arguments": words[3:],
            "folder": folder,
            "environment": environment,
            "own_session": own_session,
            "namespace": namespace,
        }
        places = (pipes[0], pipes[3], pipes[5])
        streams = [own if own != -1 else number for number, own in enumerate(places)]
        started = self.server.start(request, streams) if self.server is not None and copied else None
        if started is None:
            super()._execute_child(args, executable, preexec_fn, *rest)  # type: ignore[misc]
            return
        self.pid = started
        self._child_created = True
        self._close_pipe_fds(*pipes)  # type: ignore[attr-defined]


def _is_same(folder: str, environment: Any) -> bool:
    """Return whether a process there would import the project that is here."""
    for place in [folder, *environment.get("PYTHONPATH", "").split(os.pathsep)]:
        if (Path(place or folder) / "tenbaud" / "__main__.py").is_file():
            if Path(place or folder).resolve() != TOP:
                return False  # a changed copy of the project
            break
    return True


def _at_start(environment: Any) -> dict[str, str]:
    counting = [name for name in environment if name.startswith(READ_AT_START)]
    return {name: environment[name] for name in counting if not _is_alike(name, environment[name])}


def _is_alike(name: str, value: str) -> bool:
    return name in ALIKE and ALIKE[name] in (None, value)


class Server:
    """The side that asks; what makes the copies is started with the first request."""

    def __init__(self, connection: socket.socket | None = None) -> None:
        self._connection = connection
        self._environment = _at_start(os.environ)
        self._process: subprocess.Popen[bytes] | None = None
        self._lock = threading.Lock()

    def start(self, request: dict[str, Any], streams: list[int]) -> int | None:
        """Return the number of a new process, a child of this one; None where it has to be another.

        What is copied may have been started in another environment, or it has ended: a new one is then
        started for the next request.
        """
        with self._lock:
            own = _at_start(os.environ) if self._connection is None else self._environment
            if _at_start(request["environment"]) != own:
                return None
            if self._connection is None:
                self._start()
            assert self._connection is not None
            answer = b""
            with suppress(OSError):
                socket.send_fds(self._connection, [json.dumps(request).encode()], streams)
                answer = self._connection.recv(64)
            if not answer:
                self.close()
        return int(answer or 0) or None

    def close(self) -> None:
        """End the process that is copied; its copies go on."""
        if self._connection is not None:
            self._connection.close()
        if self._process is not None:
            self._process.wait()
        self._connection = self._process = None

    def _start(self) -> None:
        self._environment = _at_start(os.environ)
        self._connection, its = _pair()
        code = f"import sys; sys.path.insert(0, {str(TOP)!r}); from tests import warm; "
        # The last argument is where a copy writes its own command line.
        command = [sys.executable, "-c", f"{code}warm.main({its.fileno()})", "-" * NAME_BYTES_MAX]
        self._process = subprocess.Popen(command, pass_fds=[its.fileno()], stdin=subprocess.DEVNULL)
        its.close()


def _pair() -> tuple[socket.socket, socket.socket]:
    ours, its = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    ours.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, REQUEST_BYTES_MAX)
    return ours, its


def load() -> None:
    """Import what a process of `tenbaud` needs."""
    for name in IMPORTED:
        importlib.import_module(name)
    gc.freeze()


@cache
def _load_page() -> None:
    with suppress(ImportError):  # the command says what to install
        for name in PAGE:
            importlib.import_module(name)
    gc.freeze()


def main(number: int) -> None:
    """Import, and make copies until the other side has gone."""
    load()
    serve(socket.socket(fileno=number))
    os._exit(0)


def serve(connection: socket.socket) -> None:
    """Make copies until the other side has gone."""
    while True:
        data, streams, _, _ = socket.recv_fds(connection, REQUEST_BYTES_MAX, 3)
        if not data:
            return
        request = json.loads(data)
        if set(SERVES_PAGE) & set(request["arguments"]):
            _load_page()
        assert len(os.listdir("/proc/self/task")) == 1, "a copy has one thread alone"
        number = _copy()
        if number == 0:
            connection.close()
            begin(request, streams)
        connection.send(str(max(number, 0)).encode())  # 0: there was no room for another process
        for stream in streams:
            os.close(stream)


def _copy() -> int:
    """Fork; the copy is a child of this process' parent."""
    api = ctypes.pythonapi
    api.PyOS_BeforeFork()
    number = ctypes.PyDLL(None).syscall(CLONE, CLONE_PARENT | signal.SIGCHLD, 0, 0, 0, 0)
    if number == 0:
        api.PyOS_AfterFork_Child()
    else:
        api.PyOS_AfterFork_Parent()
    return int(number)


def begin(request: dict[str, Any], streams: list[int]) -> NoReturn:
    """Become the process that was asked for; never return."""
    ended: BaseException | None = None
    try:
        if request.get("own_session"):
            os.setsid()
        if request.get("namespace"):
            _enter(request["namespace"])
        if request["arguments"][:1] and request["arguments"][0] in STARTS_OTHERS:
            keep_a_copy()
        for number, stream in enumerate(streams):
            os.dup2(stream, number)
            os.close(stream)
        os.chdir(request["folder"])
        os.environ.clear()
        os.environ.update(request["environment"])
        path = os.environ.get("PYTHONPATH", "").split(os.pathsep)
        sys.path[:] = [os.getcwd(), *filter(None, path), *(one for one in sys.path if one != str(TOP))]
        importlib.invalidate_caches()
        sys.stdin = open(0, closefd=False)  # noqa: SIM115
        sys.stdout = io.TextIOWrapper(io.FileIO(1, "w", closefd=False), "utf-8")
        sys.stderr = io.TextIOWrapper(
            io.FileIO(2, "w", closefd=False), "utf-8", "backslashreplace", line_buffering=True
        )
        if "code" in request:
            sys.argv[:] = ["-c", *request["arguments"]]
            sys.modules["__main__"] = main_module = types.ModuleType("__main__")
            exec(compile(request["code"], "<string>", "exec"), main_module.__dict__)
        else:
            sys.argv[:] = [str(TOP / "tenbaud" / "__main__.py"), *request["arguments"]]
            _show([sys.executable, "-m", "tenbaud", *request["arguments"]])
            importlib.import_module("tenbaud.cli.app").main()
    except BaseException as error:
        ended = error
    finally:
        _end(ended)


def _enter(namespace: str) -> None:
    """Go to a network namespace, as `ip netns exec` does; with one thread that is the whole process."""
    with (NAMESPACES / namespace).open() as place:
        if ctypes.CDLL(None, use_errno=True).setns(place.fileno(), CLONE_NEWNET):
            number = ctypes.get_errno()
            raise OSError(number, os.strerror(number), namespace)


def _end(ended: BaseException | None) -> NoReturn:
    """End as Python does: its threads, what is done at exit, the streams, then a code or SIGINT."""
    code = 0 if ended is None else 1
    try:
        if isinstance(ended, SystemExit):
            code = (ended.code or 0) if isinstance(ended.code, int | None) else 1
            if code == 1 and not isinstance(ended.code, int):
                print(ended.code, file=sys.stderr)
        elif ended is not None:
            traceback.print_exception(ended)
        threading._shutdown()  # type: ignore[attr-defined]
        atexit._run_exitfuncs()
        for stream in (sys.stdout, sys.stderr):
            with suppress(OSError, ValueError):
                stream.flush()
        if isinstance(ended, KeyboardInterrupt):
            signal.signal(signal.SIGINT, signal.SIG_DFL)
            os.kill(os.getpid(), signal.SIGINT)
    finally:
        os._exit(code)


def _show(words: list[str]) -> None:
    """Write a command line where the system looks for it."""
    fields = Path("/proc/self/stat").read_text().rpartition(")")[2].split()
    start, end = int(fields[45]), int(fields[46])
    line = "\0".join([*words, ""]).encode(errors="surrogateescape")
    if len(line) < end - start:
        ctypes.memmove(start, line.ljust(end - start, b"\0"), end - start)


def keep_a_copy() -> None:
    """Let an untouched copy of this process start what it starts."""
    ours, its = _pair()
    if os.fork() == 0:
        ours.close()
        with suppress(KeyboardInterrupt):  # pressed for the command: its children get it too
            serve(its)
        os._exit(0)
    its.close()
    Popen.server = Server(ours)
    subprocess.Popen = Popen  # type: ignore[misc]
