"""A viewer's connection to the ends of a flight: found, lost and found again, on a thread beside."""

from __future__ import annotations

import threading
from collections import deque
from contextlib import suppress
from typing import Any, Self

import orjson

from channel.errors import LinkError
from channel.links.security import Credentials
from tenbaud.telemetry.place import found_endpoints

LOOK_PERIOD_S = 0.5
MESSAGES_MAX = 2000


class Feed:
    """Within a `with`, `take` returns the messages of the ends since the last call.

    `endpoints` are where the ends listen; none: wherever a flight of this user is found. Ends may come
    and go. `session_name` may be `**`, any. `credentials`: over TLS.
    """

    def __init__(
        self,
        endpoints: tuple[str, ...],
        session_name: str = "**",
        credentials: Credentials | None = None,
    ) -> None:
        self._credentials = credentials
        self._endpoints = endpoints
        self._session_name = session_name
        self._messages: deque[bytes] = deque(maxlen=MESSAGES_MAX)
        self._open: dict[str, Any] = {}
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._run, name="feed", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ending.set()
        self._thread.join()

    def take(self) -> list[bytes]:
        """Return the messages that have come, oldest first."""
        return [self._messages.popleft() for _ in range(len(self._messages))]

    def send(self, session_name: str, command: dict[str, object]) -> None:
        """Ask something of a flight, at both its ends; each obeys what concerns it."""
        for feed in tuple(self._open.values()):
            # The thread beside may have closed it a moment ago: the end is gone, and obeys nothing.
            with suppress(LinkError):
                feed.send(session_name, orjson.dumps(command))

    def _run(self) -> None:
        try:
            while True:
                self._look()
                if self._ending.wait(LOOK_PERIOD_S):
                    return
        finally:
            for feed in self._open.values():
                feed.close()

    def _look(self) -> None:
        from channel.links.zenoh.telemetry import TelemetryFeed

        for endpoint in [one for one, feed in self._open.items() if not feed.is_connected]:
            self._open.pop(endpoint).close()
        endpoints = self._endpoints
        if not endpoints:
            with suppress(LinkError):  # this user has no folder for flights
                endpoints = tuple(found_endpoints())
        for endpoint in endpoints:
            if endpoint not in self._open and not self._ending.is_set():
                with suppress(LinkError):  # no sender there yet, or any more
                    self._open[endpoint] = TelemetryFeed(
                        endpoint, self._session_name, self._messages.append, self._credentials
                    )
