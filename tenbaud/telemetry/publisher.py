"""The thread that sends telemetry at a set rate, separate from the loop; late messages are dropped."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Self

import orjson

from channel.errors import LinkError
from tenbaud.telemetry.compose import Composer

if TYPE_CHECKING:
    from channel.links.zenoh.telemetry import TelemetryPort


class Publisher:
    """Within a `with`, publishes `rate_hz` times a second while anybody watches, and once at the end.

    A period that passed unused, because the machine or the network held the thread up, is counted in
    the composer's `skipped`. An error ends the telemetry and nothing else; `error` then says why.
    """

    def __init__(self, composer: Composer, port: TelemetryPort, rate_hz: float) -> None:
        self.sent = 0
        self.error: str | None = None
        self.composer = composer
        self._port = port
        self._period_s = 1.0 / rate_hz
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._run, name="telemetry", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ending.set()
        self._thread.join()
        self._port.close()

    def _run(self) -> None:
        due_s = time.monotonic()
        ending = False
        while not ending and self.error is None:
            due_s += self._period_s
            late_s = time.monotonic() - due_s
            if late_s > self._period_s:
                missed = int(late_s / self._period_s)
                self.composer.skipped += missed
                due_s += missed * self._period_s
            ending = self._ending.wait(max(0.0, due_s - time.monotonic()))
            self._guard(self._send)

    def _send(self) -> None:
        watched = self._port.is_watched()
        self.composer.tap.watch(watched)
        if not watched:
            return
        message = orjson.dumps(self.composer.compose())
        try:
            self._port.publish(message)
        except LinkError:
            self.composer.skipped += 1
        else:
            self.sent += 1

    def _guard(self, do: Callable[[], None]) -> None:
        try:
            do()
        except Exception as error:  # telemetry must never end a flight
            self.error = f"telemetry ended: {type(error).__name__}: {error}"
