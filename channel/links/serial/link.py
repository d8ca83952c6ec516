"""The link over a serial line: /dev/tty..., COM..., socket://, rfc2217://, loop://.

A thread reads the port, cuts the stream into messages (`channel.links.serial.stream`) and puts them
into a bounded queue. When the port goes, as a USB adapter does when it is pulled out, the thread
tries to open it again until it is back; what is sent meanwhile is dropped and counted, as on any line.

A serial line does not tell who is at its other end, so the two links tell each other, in seven bytes
each time: a link that opens asks, the other answers, and one that closes says so. On a line so slow
that this would hold symbols up they keep quiet. `peer_present` is what follows: the port is open, and
the peer was heard within `quiet_s` and has not taken leave.
"""

from __future__ import annotations

import contextlib
import threading
import time
from queue import Empty, SimpleQueue

import serial

from channel.errors import LinkError
from channel.links.base import Link, Role
from channel.links.serial.budget import LINE_BITS_PER_BYTE
from channel.links.serial.port import check_port, open_port, reason_of
from channel.links.serial.slot_finder import START_NS
from channel.links.serial.stream import Deframer, Received
from channel.links.serial.wire import SerialWire, stuff, stuff_notice
from channel.protocol.wire import Wire

DEFAULT_LINE_RATE_BAUD = 115_200

QUEUE_MESSAGES_MAX = 10_000
BACKLOG_S_MAX = 2.0
"""A line that is this far behind takes nothing more."""
LONG_MESSAGE_S = 0.05
"""A message that takes longer is not repeated while it, or an answer to it, may be on its way."""
REOPEN_FIRST_S = 0.05
REOPEN_LAST_S = 1.0
QUIET_S = 5.0

_ASK, _HERE, _GONE = b"\1", b"\2", b"\3"

_PORT_ERRORS = (serial.SerialException, OSError, TypeError, ValueError)
"""Exceptions of pyserial on a port that disappeared or is closed by another thread."""


class SerialLink(Link):
    """One end of a session over a serial line; LinkError when the port cannot be opened.

    `is_narrow`: the downlink brings symbols too. `symbol_age_max_s`: a symbol that waited longer in
    this process, or would wait longer behind other bytes, is dropped, because its counter bits would
    no longer say which slot it belongs to.
    """

    name = "serial"
    start_ns = START_NS

    def __init__(
        self,
        role: Role,
        port: str,
        wire: SerialWire,
        *,
        line_rate_baud: int = DEFAULT_LINE_RATE_BAUD,
        symbol_age_max_s: float = 1.0,
        quiet_s: float = QUIET_S,
        insecure: bool = False,
        is_narrow: bool = False,
    ) -> None:
        super().__init__()
        check_port(port, insecure)
        self.wire: Wire = wire
        self._symbols = wire
        self._url = port
        self._line_rate_baud = line_rate_baud
        self._symbol_age_max_s = symbol_age_max_s
        self._quiet_s = quiet_s
        self._deframer = Deframer(wire if is_narrow or role == "receiver" else None, self._drop)
        self._inbox: SimpleQueue[tuple[float, bytes]] = SimpleQueue()
        self._busy_until = 0.0
        self._last_message = (b"", 0.0)
        self._heard_at: float | None = None
        self._leaving = False
        self._lost = ""
        self._stop = threading.Event()
        self._writing = threading.Lock()
        self._port: serial.SerialBase | None = open_port(port, line_rate_baud)
        self._thread = threading.Thread(target=self._read, name="serial", daemon=True)
        self._thread.start()
        self._notify(_ASK)

    def send(self, data: bytes) -> None:
        """Put one message on the line; dropped and counted when the line is gone or far behind."""
        if self._stop.is_set():
            raise LinkError("the link is closed")
        is_symbol = self._symbols.is_symbol(data)
        raw = data if is_symbol else stuff(data)
        now = time.monotonic()
        duration_s = self._duration_s(raw)
        last, again_at = self._last_message
        if duration_s > LONG_MESSAGE_S and data == last and now < again_at:
            self._drop("repeated too soon")
            return
        behind_s = self._busy_until - now
        if is_symbol and behind_s > self._symbol_age_max_s:
            self._drop("stale symbol")
            return
        if behind_s > BACKLOG_S_MAX:
            self._drop("line busy")
            return
        if self._write(raw):
            self._busy_until = max(now, self._busy_until) + duration_s
            self._last_message = (data, now + 3.0 * duration_s)
            self.counts.messages_out += 1
            self.counts.bytes_out += len(data)

    def receive(self, timeout_s: float) -> bytes | None:
        until = time.monotonic() + timeout_s
        while True:
            left_s = until - time.monotonic()
            try:
                came_at, data = self._inbox.get(left_s > 0.0, left_s if left_s > 0.0 else None)
            except Empty:
                return None
            if len(data) == 1 and time.monotonic() - came_at > self._symbol_age_max_s:
                self._drop("stale symbol")
                continue
            self.counts.messages_in += 1
            self.counts.bytes_in += len(data)
            return data

    def peer_present(self) -> bool:
        """Return whether the port is open and the peer was heard lately and did not take leave."""
        heard_at = self._heard_at
        if self._port is None or heard_at is None:
            return False
        return time.monotonic() - heard_at < self._quiet_s

    def trouble(self) -> str:
        """Return that the port went, and why, while it has not come back."""
        return self._lost

    def close(self) -> None:
        """Announce the end, send the remaining bytes, and close the port."""
        if self._stop.is_set():
            return
        with self._writing:
            # No answer to a question that is just arriving may follow the farewell.
            self._leaving = True
        self._notify(_GONE)
        port = self._port
        with contextlib.suppress(*_PORT_ERRORS):
            if port is not None:
                port.flush()
        self._stop.set()
        self._thread.join()
        self._port = None
        if port is not None:
            _close(port)

    def _drop(self, kind: str) -> None:
        self.counts.dropped[kind] += 1

    def _notify(self, body: bytes) -> None:
        raw = stuff_notice(body)
        if self._duration_s(raw) <= LONG_MESSAGE_S:
            self._write(raw, is_answer=body == _HERE)

    def _duration_s(self, raw: bytes) -> float:
        return len(raw) * LINE_BITS_PER_BYTE / self._line_rate_baud

    def _write(self, raw: bytes, is_answer: bool = False) -> bool:
        with self._writing:
            port = self._port
            if is_answer and self._leaving:
                return False
            if port is None:
                self._drop("unplugged")
                return False
            try:
                port.write(raw)
            except serial.SerialTimeoutException:
                self._drop("line full")
                return False
            except _PORT_ERRORS:
                # The reading thread meets the same error and opens the port again.
                self._drop("unplugged")
                return False
            self.counts.line_bytes_out += len(raw)
            return True

    # The reading thread

    def _read(self) -> None:
        while not self._stop.is_set():
            port = self._port
            if port is None:
                self._open_again()
                continue
            data, lost = b"", None
            try:
                data = port.read(1)
                if data:
                    data += port.read(port.in_waiting)  # type: ignore[attr-defined]
            except _PORT_ERRORS as error:
                lost = error
            # The first byte may be the last one of a message, and the port gone after it.
            self.counts.line_bytes_in += len(data)
            for received in self._deframer.feed(data):
                self._take(received)
            if lost is not None:
                self._lose(port, lost)

    def _take(self, received: Received) -> None:
        now = time.monotonic()
        if received.is_notice:
            self._heard_at = None if received.message == _GONE else now
            if received.message == _ASK:
                self._notify(_HERE)
            return
        self._heard_at = now
        if self._inbox.qsize() >= QUEUE_MESSAGES_MAX:
            self._drop("queue full")
        else:
            self._inbox.put((now, received.message))

    def _lose(self, port: serial.SerialBase, error: Exception) -> None:
        if not self._stop.is_set():
            self._lost = (
                f"the serial port {self._url} was lost ({reason_of(error)}) and did not come back"
            )
        with self._writing:
            self._port = None
        _close(port)
        self._heard_at = None
        self._deframer.reset()

    def _open_again(self) -> None:
        wait_s = REOPEN_FIRST_S
        while not self._stop.wait(wait_s):
            try:
                port = open_port(self._url, self._line_rate_baud)
            except LinkError:
                wait_s = min(2.0 * wait_s, REOPEN_LAST_S)
                continue
            self.counts.reconnects += 1
            self._busy_until = 0.0
            with self._writing:
                self._port = port
            self._lost = ""
            self._notify(_ASK)
            return


def _close(port: serial.SerialBase) -> None:
    with contextlib.suppress(*_PORT_ERRORS):
        port.close()
