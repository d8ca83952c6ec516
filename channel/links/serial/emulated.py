"""A serial line between two processes of this machine, made of two pseudo-terminals.

A pseudo-terminal stores a baud rate and does not keep to it. Here a thread stands between two of them
and passes bytes on no faster than a real line of that rate would, each direction by itself, and it can
be pulled out and plugged in again. The two ports have fixed names in a folder, links to the
pseudo-terminals of the moment.
"""

from __future__ import annotations

import contextlib
import os
import select
import threading
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, Self

from channel.links.serial.budget import LINE_BITS_PER_BYTE
from channel.links.serial.pseudo_terminal import PseudoTerminal

Way = Literal["up", "down"]

QUEUE_BYTES_MAX = 4096
"""Capacity of a direction; further bytes stay in the sender's buffer, as with a real port."""
STEP_S = 0.0005
"""Bytes of a fast line are passed on in steps of this: late by at most so much, never early."""
BLOCKED_S = 0.2
IDLE_S = 0.1


@dataclass(slots=True)
class _Direction:
    rate_baud: float | None
    carried: int = 0
    _queue: bytearray = field(default_factory=bytearray)
    _due: float = 0.0
    """when the first byte of the queue has arrived"""
    _blocked_since: float | None = None

    @property
    def room(self) -> int:
        return QUEUE_BYTES_MAX - len(self._queue)

    def put(self, data: bytes, now: float) -> None:
        if not self._queue:
            self._due = now + self._byte_s
        self._queue += data

    def deliver(self, target: int, now: float) -> None:
        """Write the bytes that have arrived by now to a pseudo-terminal.

        A reader that takes nothing for `BLOCKED_S`, or is not there, loses them.
        """
        if not self._queue or now < self._due:
            return
        count = len(self._queue)
        if self.rate_baud is not None:
            count = min(count, int((now - self._due) / self._byte_s) + 1)
        try:
            written = os.write(target, self._queue[:count])
            self._blocked_since = None
        except BlockingIOError:
            written = 0
            self._blocked_since = self._blocked_since or now
            if now - self._blocked_since > BLOCKED_S:
                written = count
        del self._queue[:written]
        self._due += written * self._byte_s
        self.carried += written

    def wait_s(self, now: float) -> float:
        """Return how long until there is something to take, in steps."""
        return max(STEP_S, self._due - now) if self._queue else IDLE_S

    @property
    def _byte_s(self) -> float:
        return 0.0 if self.rate_baud is None else LINE_BITS_PER_BYTE / self.rate_baud


class EmulatedLine:
    """Within a `with`, a serial line between `transmitter_port` and `receiver_port`.

    `rate_baud` None: as fast as it goes. `folder` must exist.
    """

    def __init__(self, folder: Path, rate_baud: float | None = 115_200) -> None:
        self.transmitter_port = folder / "transmitter"
        self.receiver_port = folder / "receiver"
        self._ways: dict[Way, _Direction] = {"up": _Direction(rate_baud), "down": _Direction(rate_baud)}
        self._ends = (PseudoTerminal(self.transmitter_port), PseudoTerminal(self.receiver_port))
        self._lock = threading.Lock()
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="emulated line", daemon=True)

    def __enter__(self) -> Self:
        self.plug()
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join()
        self.unplug()

    def carried(self, way: Way) -> int:
        with self._lock:  # else a byte may be read at its end before it is counted
            return self._ways[way].carried

    def put(self, way: Way, data: bytes) -> None:
        """Put bytes on the line, with its lock held."""
        self._ways[way].put(data, time.monotonic())

    def plug(self) -> None:
        """Plug both ends in: two new pseudo-terminals under the same names."""
        with self._lock:
            for one in self._ends:
                one.plug()

    def unplug(self) -> None:
        """Pull both ends out: processes that have them open get an error, and their names are gone."""
        with self._lock:
            for one in self._ends:
                one.unplug()

    def _run(self) -> None:
        while not self._stop.is_set():
            with self._lock:
                wait_s = self._pass_on()
                readable = [
                    end.handle
                    for end, way in zip(self._ends, self._ways.values(), strict=True)
                    if end.handle >= 0 and way.room > 0
                ]
            try:
                select.select(readable, [], [], wait_s)
            except OSError:  # unplugged in between
                continue

    def _pass_on(self) -> float:
        """Move the bytes that are due; return how long to wait."""
        near, far = (end.handle for end in self._ends)
        if near < 0 or far < 0:
            return STEP_S * 10
        now = time.monotonic()
        for (name, way), source, target in zip(
            self._ways.items(), (near, far), (far, near), strict=True
        ):
            if way.room > 0:
                with contextlib.suppress(BlockingIOError):
                    self.put(name, os.read(source, way.room))
            way.deliver(target, now)
        return min(way.wait_s(now) for way in self._ways.values())
