"""A QUARC model as the rig, over plain TCP: its Stream blocks send raw doubles.

The model may be the server or the client. A unit is `N` doubles and nothing else, so the bytes are
put together to exactly that; of several units that came at once the newest counts and the others are
skipped. A unit that makes no sense means that the alignment is lost, and it does not come back by
itself: the connection is closed and made anew.
"""

from __future__ import annotations

import contextlib
import math
import select
import socket
import threading
import time
from typing import Literal

from transmitter.rigs.base import RigError
from transmitter.rigs.device import DeviceRig, Wiring
from transmitter.rigs.formats.doubles import DoublesLayout, UnitError, doubles

Role = Literal["client", "server"]
WAIT_S = 0.05
RECONNECT_PERIOD_S = 0.2
CONNECT_TIMEOUT_S = 1.0
READ_BYTES = 65_536


class QuarcBridge(DeviceRig):
    """Encoders and motors of a running QUARC model.

    `layout` describes the model's output vector. `command_fields` name its input vector: `v0`, `v1`
    (outputs 0 and 1), `seq`, `enable`.
    """

    def __init__(
        self,
        host: str,
        port: int,
        role: Role,
        layout: DoublesLayout,
        command_fields: tuple[str, ...],
        wiring: Wiring,
    ) -> None:
        super().__init__(wiring, layout.wraps)
        self.name = f"QUARC {role} at {host}:{port}"
        self._address = (host, port)
        self._role = role
        self._layout = layout
        self._command_fields = command_fields
        self._command = doubles(len(command_fields), layout.byte_order)
        self._listener: socket.socket | None = None
        self._peer: socket.socket | None = None
        self._sequence = 0
        self._last_unit_error = ""
        self._lock = threading.Lock()

    def _connect(self) -> None:
        if self._role == "server":
            try:
                family = socket.AF_INET6 if ":" in self._address[0] else socket.AF_INET
                self._listener = socket.create_server(self._address, family=family, backlog=1)
            except OSError as error:
                raise RigError(
                    f"{self.name}: cannot listen: {error}; is another program using the port?"
                ) from error
            self._listener.settimeout(WAIT_S)

    def _run(self) -> None:
        rest = b""
        while not self._closing.is_set():
            if self._peer is None:
                rest = b""
                if not self._meet():
                    self._closing.wait(0.0 if self._role == "server" else RECONNECT_PERIOD_S)
                    continue
            data = self._receive()
            if data is None:
                self._drop("the other end closed the connection", len(rest))
                continue
            if data:
                rest = self._take_units(rest + data)

    def _take_units(self, data: bytes) -> bytes:
        """Hand over the newest whole unit; return the bytes of the one that has begun."""
        size = self._layout.struct.size
        whole = len(data) // size
        if not whole:
            return data
        host_ns = time.monotonic_ns()
        try:
            for index in range(whole):
                self._take(self._layout.decode(data[index * size : (index + 1) * size]), host_ns)
        except UnitError as error:
            self._last_unit_error = f"({error})"
            self.counts["misaligned"] += 1
            self._drop(str(error))
            return b""
        return data[whole * size :]

    def _receive(self) -> bytes | None:
        """Return what has come, nothing after a short wait, None when the peer is gone."""
        peer = self._peer
        if peer is None:
            return None
        try:
            ready, _, _ = select.select([peer], [], [], WAIT_S)
            if not ready:
                return b""
            return peer.recv(READ_BYTES) or None
        except (OSError, ValueError):
            return None

    def _meet(self) -> bool:
        try:
            if self._listener is not None:
                peer, _ = self._listener.accept()
            else:
                peer = socket.create_connection(self._address, CONNECT_TIMEOUT_S)
        except OSError as error:
            if not isinstance(error, TimeoutError):
                self._problem = f"({self._role}: {error})"
            return False
        # Nagle's algorithm would hold a command back until the one before is acknowledged.
        peer.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        peer.settimeout(WAIT_S)
        self._peer = peer
        self._problem = ""
        self.counts["connections"] += 1
        return True

    def _drop(self, why: str, tail_bytes: int = 0) -> None:
        peer, self._peer = self._peer, None
        tail = f", in the middle of a unit ({tail_bytes} bytes)" if tail_bytes else ""
        self._problem = f"({why}{tail})"
        if peer is not None:
            with contextlib.suppress(OSError):
                peer.close()

    def _send(self, outputs: tuple[float, ...], enable: bool) -> None:
        self._sequence += 1
        known = {"seq": float(self._sequence), "enable": float(enable)}
        known |= {f"v{index}": value for index, value in enumerate(outputs)}
        data = self._command.pack(*(known.get(name, 0.0) for name in self._command_fields))
        peer = self._peer
        if peer is None:
            self.counts["writes_lost"] += 1
            return
        try:
            # The reader's thread turns the outputs off too; two units must not mix.
            with self._lock:
                peer.sendall(data)
        except OSError as error:
            # A unit may have gone out in part; only a new connection is aligned again.
            self.counts["writes_lost"] += 1
            self._drop(f"a command could not be sent: {error}")

    def _disconnect(self) -> None:
        self._drop("closed")
        listener, self._listener = self._listener, None
        if listener is not None:
            listener.close()

    def _no_sample_hint(self) -> str:
        if self._last_unit_error:
            return f" {self._last_unit_error}"
        if self.counts["connections"] == 0:
            other = "client" if self._role == "server" else "server"
            return (
                f": nothing connected; is the model running, with its Stream {other} block? "
                f"{self._problem}"
            )
        return f": connected, but no whole unit of {len(self._layout.fields)} doubles came"


def scale_of(unit: str, counts_per_turn: int) -> float:
    """Return the size of one count in "counts", "rad" or "deg"."""
    return {"counts": 1.0, "rad": math.tau / counts_per_turn, "deg": 360.0 / counts_per_turn}[unit]
