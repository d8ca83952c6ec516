"""The line of an emulated device: a pseudo-terminal of its own, a serial port, or TCP."""

from __future__ import annotations

import contextlib
import os
import select
import socket
from pathlib import Path
from typing import Protocol

from channel.links.serial.pseudo_terminal import PseudoTerminal
from transmitter.rigs.base import RigError

READ_BYTES = 4096


class DeviceLine(Protocol):
    """Bytes in and out, without waiting; bytes that are not read are lost, as on a real line."""

    address: str
    """the name that the other side opens"""

    def plug(self) -> None:
        """Put the device on its line."""

    def unplug(self) -> None:
        """Take it off."""

    def wait(self, timeout_s: float) -> None:
        """Wait until something came, or for this long."""

    def read(self) -> bytes:
        """Return the received bytes."""

    def write(self, data: bytes) -> bool:
        """Send; return whether it went out whole."""


class _Handled:
    """What a file handle of the system's carries; -1 while the line is unplugged."""

    handle = -1

    def wait(self, timeout_s: float) -> None:
        _wait(self.handle, timeout_s)

    def read(self) -> bytes:
        try:
            return os.read(self.handle, READ_BYTES) if self.handle >= 0 else b""
        except OSError:
            return b""

    def write(self, data: bytes) -> bool:
        try:
            return self.handle >= 0 and os.write(self.handle, data) == len(data)
        except OSError:
            return False


class PtyLine(PseudoTerminal, _Handled):
    """A pseudo-terminal; `link` names it all the same after every plugging in."""

    def __init__(self, link: str = "") -> None:
        super().__init__(Path(link) if link else None)


class SerialLine(_Handled):
    """A real serial port: the other computer is at the end of a crossed cable."""

    def __init__(self, device: str, line_baud: int) -> None:
        self.address = device
        self._line_baud = line_baud

    def plug(self) -> None:
        from channel.links.serial.port import open_port

        self._port = open_port(self.address, self._line_baud, 0.0)
        self.handle = self._port.fileno()
        os.set_blocking(self.handle, False)

    def unplug(self) -> None:
        self.handle = -1
        self._port.close()


class TcpLine:
    """One TCP connection at a time: accepted here, or made to the other side."""

    def __init__(self, host: str, port: int, *, connects: bool = False) -> None:
        self._host, self._port = host, port
        self._connects = connects
        self._listener: socket.socket | None = None
        self._peer: socket.socket | None = None
        self._plugged = False
        self._pending = b""
        self.address = self._named()

    def plug(self) -> None:
        self._plugged = True
        if self._connects:
            return
        try:
            family = socket.AF_INET6 if ":" in self._host else socket.AF_INET
            self._listener = socket.create_server((self._host, self._port), family=family, backlog=1)
        except OSError as error:
            raise RigError(f"{self.address} cannot be listened on: {error}") from error
        self._listener.setblocking(False)
        self._port = self._listener.getsockname()[1]
        self.address = self._named()

    def _named(self) -> str:
        host = f"[{self._host}]" if ":" in self._host else self._host
        return f"{host}:{self._port}"

    def unplug(self) -> None:
        """Drop the connection and do not take another."""
        self._plugged = False
        self._drop()
        if self._listener is not None:
            self._listener.close()
            self._listener = None

    def wait(self, timeout_s: float) -> None:
        handle = self._peer or self._listener
        _wait(-1 if handle is None else handle.fileno(), timeout_s)

    def read(self) -> bytes:
        if self._peer is None and not self._meet():
            return b""
        assert self._peer is not None
        try:
            data = self._peer.recv(READ_BYTES)
        except BlockingIOError:
            return b""
        except OSError:
            data = b""
        if not data:
            self._drop()
        return data

    def write(self, data: bytes) -> bool:
        """Send whole units only: a piece of one would shift all that follow."""
        if self._peer is None:
            return False
        try:
            if self._pending:
                self._pending = self._pending[self._peer.send(self._pending) :]
            if self._pending:
                return False
            self._pending = data[self._peer.send(data) :]
        except BlockingIOError:
            return False
        except OSError:
            self._drop()
            return False
        return True

    def _meet(self) -> bool:
        if not self._plugged:
            return False
        try:
            if self._listener is not None:
                self._peer, _ = self._listener.accept()
            else:
                self._peer = socket.create_connection((self._host, self._port), 0.05)
        except OSError:
            return False
        self._peer.setblocking(False)
        self._peer.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        return True

    def _drop(self) -> None:
        self._pending = b""
        peer, self._peer = self._peer, None
        if peer is not None:
            with contextlib.suppress(OSError):
                peer.close()


def parse_line(text: str, line_baud: int) -> PtyLine | SerialLine | TcpLine:
    """Return the line that a command line names; ValueError for an invalid one."""
    kind, _, rest = text.partition(":")
    if kind == "pty":
        return PtyLine(rest)
    if kind in ("tcp", "tcp-connect"):
        host, _, port = rest.rpartition(":")
        if not host or not port.isdigit():
            raise ValueError(f"port {text!r}: write tcp:HOST:PORT or tcp-connect:HOST:PORT")
        return TcpLine(host.strip("[]"), int(port), connects=kind == "tcp-connect")
    if not text:
        raise ValueError("port: pty, pty:LINK, /dev/NAME, tcp:HOST:PORT or tcp-connect:HOST:PORT")
    return SerialLine(text, line_baud)


def _wait(handle: int, timeout_s: float) -> None:
    handles = [handle] if handle >= 0 else []
    select.select(handles, [], [], max(0.0, timeout_s))
