"""A rig behind a serial port: a microcontroller, or a US Digital adapter.

Any port of `serial_for_url`: `/dev/ttyACM0`, `COM3`, `socket://host:port`, `rfc2217://...`.
A port that disappears is opened again as soon as it is back.
"""

from __future__ import annotations

import contextlib
import select
import threading
import time
from typing import TYPE_CHECKING

from channel.errors import LinkError
from channel.links.serial.port import open_port
from transmitter.rigs.base import RigError
from transmitter.rigs.device import DeviceRig, Wiring
from transmitter.rigs.formats.base import SerialFormat

if TYPE_CHECKING:
    import serial

READ_TIMEOUT_S = 0.02
READ_BYTES = 4096
WRITE_TIMEOUT_S = 0.05
REOPEN_PERIOD_S = 0.2
POLL_PERIOD_S = 0.005
"""A device that has to be asked is asked this often; one that does not answer, every READ_TIMEOUT_S."""


class BytePort:
    """A serial port that comes back: reading and writing never raise for a device that is gone.

    One thread reads and reopens, another may write. `problem` says why it is closed.
    """

    def __init__(self, url: str, line_baud: int) -> None:
        self.url = url
        self.problem = ""
        self.reconnects = 0
        self._line_baud = line_baud
        self._port: serial.SerialBase | None = None
        self._lock = threading.Lock()
        self._handle: int | None = None
        """to ask whether the port takes more; None where there is none"""
        self._is_socket = url.startswith("socket://")

    def open(self) -> None:
        """Open for this process alone; RigError, with what to do, when that is impossible."""
        try:
            port = open_port(self.url, self._line_baud, READ_TIMEOUT_S, WRITE_TIMEOUT_S)
        except LinkError as error:
            raise RigError(str(error)) from error
        try:
            self._handle = port.fileno()
            port.write_timeout = 0
        except (AttributeError, OSError, ValueError):
            # Windows, and rfc2217: they keep the time-out.
            self._handle = None
        self._port = port
        self.problem = ""

    @property
    def is_open(self) -> bool:
        return self._port is not None

    def reopen(self) -> bool:
        """Try to get a lost device back; return whether it is there."""
        try:
            self.open()
        except RigError:
            # `problem` still says how it was lost; that it is not back is plain from that.
            return False
        self.reconnects += 1
        return True

    def read(self) -> bytes:
        """Return what has come, nothing after a short wait or when the device has gone."""
        port = self._port
        if port is None:
            return b""
        try:
            if not self._is_socket:
                return bytes(port.read(max(1, getattr(port, "in_waiting", 1))))
            # A socket does not say how much waits: take one byte, then whatever is there.
            first = bytes(port.read(1))
            if not first:
                return b""
            port.timeout = 0
            try:
                return first + bytes(port.read(READ_BYTES))
            finally:
                port.timeout = READ_TIMEOUT_S
        except Exception as error:
            # OSError, TypeError, ValueError, termios.error: pyserial lets them all through when a
            # device vanishes or another thread closes the port.
            self._lose(error)
            return b""

    def write(self, data: bytes) -> bool:
        """Send these bytes without waiting; return whether the port took them all."""
        port = self._port
        if port is None or not data:
            return not data
        try:
            with self._lock:
                if self._handle is None:
                    return port.write(data) == len(data)
                # pyserial would wait, after the write, until the port could take more: up to its
                # time-out, in the middle of a tick. So the call tests it in advance and does not wait.
                _, ready, _ = select.select([], [self._handle], [], 0.0)
                return bool(ready) and port.write(data) == len(data)
        except Exception as error:
            if type(error).__name__ != "SerialTimeoutException":
                self._lose(error)
            return False

    def close(self) -> None:
        port, self._port = self._port, None
        if port is not None:
            # What was written last says that the motors are off: let it out before the port closes.
            with contextlib.suppress(Exception):
                port.flush()
            with contextlib.suppress(Exception):
                port.close()

    def _lose(self, error: Exception) -> None:
        self.problem = f"({self.url} is gone: {error})"
        port, self._port = self._port, None
        if port is not None:
            with contextlib.suppress(Exception):
                port.close()


class SerialBridge(DeviceRig):
    """Encoders, and mostly motors, at the other end of a serial line.

    `motor_port` is a second line for the commands, in `motor_format`: an encoder adapter has no
    outputs.
    """

    name = "serial bridge"

    def __init__(
        self,
        port: BytePort,
        serial_format: SerialFormat,
        wiring: Wiring,
        *,
        motor_port: BytePort | None = None,
        motor_format: SerialFormat | None = None,
    ) -> None:
        super().__init__(wiring, serial_format.wraps)
        self.name = f"{serial_format.name} at {port.url}"
        self._port = port
        self._format = serial_format
        self._motor_port = port if motor_port is None else motor_port
        self._motor_format = motor_format or serial_format
        self._sequence = 0
        if self.settings.output and not self._motor_format.has_output:
            raise RigError(
                f"{self.name}: this format carries no commands, so nothing would turn the motors; "
                "name a motor_port for them, or add --dry-run"
            )

    def _connect(self) -> None:
        self._port.open()
        if self._motor_port is not self._port and self.settings.output:
            self._motor_port.open()
        self._greet()

    def _greet(self) -> None:
        self._format.reset()
        self._port.write(self._format.greeting)

    def _run(self) -> None:
        poll = self._format.poll
        asked_at = 0.0
        while not self._closing.is_set():
            if not self._all_there():
                continue
            now = time.monotonic()
            if poll and now - asked_at > POLL_PERIOD_S:
                self._port.write(poll)
                asked_at = now
            data = self._port.read()
            host_ns = time.monotonic_ns()
            for raw in self._format.feed(data) if data else ():
                self._take(raw, host_ns)
            if poll and data:
                time.sleep(max(0.0, asked_at + POLL_PERIOD_S - time.monotonic()))

    def _all_there(self) -> bool:
        """Return whether the ports are open; try to get a lost one back, after a wait."""
        lost = [port for port in {self._port, self._motor_port} if not port.is_open]
        if not lost or (lost == [self._motor_port] and not self.settings.output):
            return True
        self._problem = lost[0].problem
        if self._closing.wait(REOPEN_PERIOD_S) or not all(port.reopen() for port in lost):
            return False
        self._problem = ""
        if self._port in lost:
            self._greet()
        return True

    def _send(self, outputs: tuple[float, ...], enable: bool) -> None:
        self._sequence += 1
        message = self._motor_format.command(self._sequence, outputs, enable)
        if not self._motor_port.write(message):
            self.counts["writes_lost"] += 1

    def _disconnect(self) -> None:
        self._port.close()
        self._motor_port.close()

    def _no_sample_hint(self) -> str:
        seen = dict(self._format.counts)
        if seen:
            return f" ({seen}): is it another format, or another line_baud?"
        return " and not one byte that could be one: is it the right port, and the device running?"

    def figures(self) -> dict[str, object]:
        return {**super().figures(), **self._format.counts, "reconnects": self._port.reconnects}
