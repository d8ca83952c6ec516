"""Telemetry over Zenoh: a session of its own beside the link, so that no viewer can touch the flight.

Keys, `NAME` being the session's name and `ROLE` the end's:

    tenbaud/NAME/telemetry/ROLE   what an end tells about itself
    tenbaud/NAME/control          what a person asks of a flight that allows it

An end listens and whoever wants to look connects. What a viewer does not take is dropped: the
publisher's thread waits a millisecond at most, and the loop never waits for that thread.
"""

from __future__ import annotations

import json
from collections.abc import Callable

import zenoh

from channel.errors import LinkError
from channel.links.base import Role

OnMessage = Callable[[bytes], None]


class TelemetryPort:
    """An end's side: listens on one endpoint, publishes, and hands commands over if it takes any.

    `on_command` runs on a thread of Zenoh and may only put the bytes away. Raises LinkError when the
    endpoint cannot be used.
    """

    def __init__(
        self, role: Role, session_name: str, endpoint: str, on_command: OnMessage | None = None
    ) -> None:
        self._session = _open("peer", listen=(endpoint,))
        self._publisher = self._session.declare_publisher(
            f"tenbaud/{session_name}/telemetry/{role}",
            congestion_control=zenoh.CongestionControl.DROP,
            priority=zenoh.Priority.BACKGROUND,
        )
        if on_command is not None:
            self._session.declare_subscriber(
                f"tenbaud/{session_name}/control", _handler(on_command, 4096)
            )

    def publish(self, data: bytes) -> None:
        """Send one message to whoever listens. Raises LinkError."""
        try:
            self._publisher.put(data)
        except zenoh.ZError as error:
            raise LinkError(f"telemetry could not be sent: {error}") from error

    def close(self) -> None:
        """Close the session."""
        self._session.close()


class TelemetryFeed:
    """A viewer's side: connected to one end. Raises LinkError when nobody listens there.

    `on_message` runs on a thread of Zenoh and may only put the bytes away.
    """

    def __init__(self, endpoint: str, session_name: str, on_message: OnMessage) -> None:
        self.endpoint = endpoint
        self._session = _open("client", connect=(endpoint,))
        self._name = session_name
        self._session.declare_subscriber(
            f"tenbaud/{session_name}/telemetry/*", _handler(on_message, 1 << 20)
        )

    @property
    def is_connected(self) -> bool:
        """Return whether the end is still there."""
        return bool(self._session.info.peers_zid() or self._session.info.routers_zid())

    def send(self, session_name: str, data: bytes) -> None:
        """Ask something of the flight of that name; nobody answers but the telemetry."""
        self._session.put(f"tenbaud/{session_name}/control", data)

    def close(self) -> None:
        """Close the session."""
        self._session.close()


def _handler(take: OnMessage, bytes_max: int) -> zenoh.handlers.Callback[zenoh.Sample]:
    def on_sample(sample: zenoh.Sample) -> None:
        data = sample.payload.to_bytes()
        if len(data) <= bytes_max:
            take(data)

    return zenoh.handlers.Callback(on_sample, indirect=False)


def _open(mode: str, listen: tuple[str, ...] = (), connect: tuple[str, ...] = ()) -> zenoh.Session:
    config = zenoh.Config()
    settings: dict[str, object] = {
        "mode": mode,
        "listen/endpoints": list(listen),
        "connect/endpoints": list(connect),
        "connect/timeout_ms": 1000,
        "scouting/delay": 0,
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": False,
        "transport/shared_memory/enabled": False,
    }
    for path, value in settings.items():
        config.insert_json5(path, json.dumps(value))
    try:
        return zenoh.open(config)
    except zenoh.ZError as error:
        at = ", ".join(listen + connect)
        raise LinkError(f"telemetry cannot use {at}: {error}") from error
