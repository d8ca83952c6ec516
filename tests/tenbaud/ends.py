"""The two ends as long-lived processes that a test may kill, stop and start again."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from channel.links.serial.emulated import EmulatedLine
from tests.tenbaud.processes import REPOSITORY

PATIENCE_S = 240.0
"""For what ends as soon as it may. On a machine with much else to do a process may start slowly."""


class End:
    """One end on the real clock; its status lines are read as they come."""

    def __init__(
        self,
        verb: str,
        link: list[str],
        folder: Path,
        *arguments: str,
        prefix: Sequence[str] = (),
        draws: bool = True,
    ) -> None:
        self.verb = verb
        self.folder = folder
        self.status: dict[str, Any] = {}
        self.said: list[str] = []
        command = [*prefix, sys.executable, "-m", "tenbaud", verb, *link, "--clock", "real", "--json"]
        if not draws:
            folder.mkdir()
        command += ["--status", "lines", "--out" if draws else "--run-folder", str(folder), *arguments]
        path = os.pathsep.join([str(REPOSITORY), os.environ.get("PYTHONPATH", "")])
        self.process = subprocess.Popen(
            command,
            env={**os.environ, "PYTHONPATH": path},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        self._thread = threading.Thread(target=self._read, daemon=True)
        self._thread.start()

    def _read(self) -> None:
        assert self.process.stderr is not None
        for line in self.process.stderr:
            if line.startswith("{"):
                self.status = json.loads(line)
            else:
                self.said.append(line.rstrip())

    @property
    def flies(self) -> bool:
        return self.status.get("phase") == "flying" and self.status.get("guard", "running") == "running"

    def kill(self) -> None:
        self.process.kill()
        self.process.wait()

    def stop_politely(self) -> tuple[int, dict[str, Any]]:
        """Interrupt, wait, and return the exit code and the summary."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
        return self.ended()

    def ended(self) -> tuple[int, dict[str, Any]]:
        assert self.process.stdout is not None
        out = self.process.stdout.read()
        code = self.process.wait(PATIENCE_S)
        self._thread.join(5.0)
        return code, json.loads(out)


class Pair:
    """Transmitter and receiver, with a way to replace either.

    `links` are the arguments that lead each end to the other.
    """

    def __init__(self, folder: Path, links: dict[str, list[str]], *arguments: str) -> None:
        self.folder = folder
        self.links = links
        self.arguments = arguments
        self.count = 0
        self.receiver = self.start("receive")
        self.transmitter = self.start("transmit")

    def start(self, verb: str) -> End:
        self.count += 1
        folder = self.folder / f"{self.count:02}-{verb}"
        more = ["--set", "link.peer_timeout_s=30", *self.arguments]
        if verb == "transmit":
            more += ["--duration", "3600"]
        end = End(verb, self.links[verb], folder, *more)
        setattr(self, "receiver" if verb == "receive" else "transmitter", end)
        return end

    def wait_until_both_fly(self) -> None:
        """Return when commands reach the motors again; fail with what both said."""
        sample = self.receiver.status.get("time_s")
        wait_for(
            lambda: (
                self.transmitter.flies
                and self.receiver.flies
                and self.receiver.status.get("time_s") != sample
            ),
            lambda: (
                f"{self.transmitter.status} {self.transmitter.said} {self.receiver.status} "
                f"{self.receiver.said}"
            ),
        )

    def close(self) -> None:
        for end in (self.transmitter, self.receiver):
            if end.process.poll() is None:
                end.kill()


def over_zenoh(listen: str, connect: str | None = None) -> dict[str, list[str]]:
    """Return the links of a pair over Zenoh; `connect` leads elsewhere when a relay stands between."""
    return {"receive": ["--listen", listen], "transmit": ["--connect", connect or listen]}


def over_serial(line: EmulatedLine) -> dict[str, list[str]]:
    """Return the links of a pair over a serial line."""
    ports = {"receive": line.receiver_port, "transmit": line.transmitter_port}
    return {verb: ["--link", "serial", "--port", str(port)] for verb, port in ports.items()}


def wait_for(met: Callable[[], bool], told: Callable[[], str]) -> None:
    until = time.monotonic() + PATIENCE_S
    while not met():
        assert time.monotonic() < until, f"not within {PATIENCE_S} s: {told()}"
        time.sleep(0.05)


class Relay:
    """A TCP line that can be cut (connections closed, none taken) and muted (nothing passes)."""

    def __init__(self, target_port: int) -> None:
        self._target_port = target_port
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port: int = self._listener.getsockname()[1]
        self._sockets: list[socket.socket] = []
        self._open = threading.Event()
        self._open.set()
        self.is_cut = False
        threading.Thread(target=self._accept, daemon=True).start()

    def _accept(self) -> None:
        while True:
            try:
                near, _ = self._listener.accept()
            except OSError:
                return
            if self.is_cut:
                near.close()
                continue
            try:
                far = socket.create_connection(("127.0.0.1", self._target_port))
            except OSError:
                near.close()
                continue
            self._sockets += [near, far]
            for one, other in ((near, far), (far, near)):
                threading.Thread(target=self._pump, args=(one, other), daemon=True).start()

    def _pump(self, source: socket.socket, sink: socket.socket) -> None:
        try:
            while data := source.recv(65536):
                self._open.wait()
                sink.sendall(data)
        except OSError:
            pass
        for end in (source, sink):
            end.close()

    def mute(self, seconds: float) -> None:
        self._open.clear()
        time.sleep(seconds)
        self._open.set()

    def cut(self, seconds: float) -> None:
        self.is_cut = True
        for one in self._sockets:
            with contextlib.suppress(OSError):
                one.shutdown(socket.SHUT_RDWR)
        self._sockets.clear()
        time.sleep(seconds)
        self.is_cut = False

    def close(self) -> None:
        self._open.set()
        self._listener.close()
        for one in self._sockets:
            one.close()
