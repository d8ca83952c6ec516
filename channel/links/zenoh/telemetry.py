"""Telemetry over Zenoh: a separate session beside the link, so that no viewer can affect the flight.

Keys, `NAME` being the session's name and `ROLE` the end's:

    tenbaud/NAME/telemetry/ROLE   what an end tells about itself
    tenbaud/NAME/control          what a person asks of a flight that allows it

An end listens and viewers connect. What a viewer does not take is dropped: the
publisher's thread waits a millisecond at most, and the loop never waits for that thread.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import zenoh

from channel.errors import LinkError
from channel.links.base import Role
from channel.links.security import KEY_ROOT, Credentials, Security, tls_settings
from channel.links.zenoh.config import close_session, open_session, zenoh_config, zenoh_settings

OnMessage = Callable[[bytes], None]


class TelemetryPort:
    """An end's side: listens on one endpoint, publishes, and hands commands over if it takes any.

    `on_command` runs on a thread of Zenoh and may only put the bytes away. `security`: TLS, and only
    the viewers and operators that it invites. Raises LinkError when the endpoint cannot be used.
    """

    def __init__(
        self,
        role: Role,
        session_name: str,
        endpoint: str,
        on_command: OnMessage | None = None,
        security: Security | None = None,
    ) -> None:
        settings = zenoh_settings("peer", (endpoint,), (), security=security)
        self._session = open_session(zenoh_config(settings), f"{endpoint} for telemetry")
        with _closed_on_error(self._session, session_name):
            self._publisher = self._session.declare_publisher(
                f"{KEY_ROOT}/{session_name}/telemetry/{role}",
                congestion_control=zenoh.CongestionControl.DROP,
                priority=zenoh.Priority.BACKGROUND,
            )
            if on_command is not None:
                self._session.declare_subscriber(
                    f"{KEY_ROOT}/{session_name}/control", _handler(on_command, 4096)
                )

    def is_watched(self) -> bool:
        """Return whether anybody subscribes to this end's telemetry. Raises LinkError."""
        try:
            # Zenoh's annotation says bool; it is an object with this one field.
            status: Any = self._publisher.matching_status
            return bool(status.matching)
        except zenoh.ZError as error:
            raise LinkError(f"telemetry could not be sent: {error}") from error

    def publish(self, data: bytes) -> None:
        """Send one message to all subscribers. Raises LinkError."""
        try:
            self._publisher.put(data)
        except zenoh.ZError as error:
            raise LinkError(f"telemetry could not be sent: {error}") from error

    def close(self) -> None:
        close_session(self._session)


class TelemetryFeed:
    """A viewer's side: connected to one end. Raises LinkError when nobody listens there.

    `on_message` runs on a thread of Zenoh and may only put the bytes away. `credentials`: over TLS.
    """

    def __init__(
        self,
        endpoint: str,
        session_name: str,
        on_message: OnMessage,
        credentials: Credentials | None = None,
    ) -> None:
        self.endpoint = endpoint
        settings = zenoh_settings("client", (), (endpoint,)) | {"connect/timeout_ms": 1000}
        if credentials is not None:
            settings |= tls_settings(credentials)
        self._session = open_session(zenoh_config(settings), f"{endpoint} for telemetry")
        with _closed_on_error(self._session, session_name):
            self._session.declare_subscriber(
                f"{KEY_ROOT}/{session_name}/telemetry/*", _handler(on_message, 1 << 20)
            )

    @property
    def is_connected(self) -> bool:
        return bool(self._session.info.peers_zid() or self._session.info.routers_zid())

    def send(self, session_name: str, data: bytes) -> None:
        """Ask something of the flight of that name; nobody answers but the telemetry.

        May be called while another thread closes: LinkError once it has.
        """
        try:
            self._session.put(f"{KEY_ROOT}/{session_name}/control", data)
        except zenoh.ZError as error:
            raise LinkError(f"the command could not be sent: {error}") from error

    def close(self) -> None:
        close_session(self._session)


@contextmanager
def _closed_on_error(session: zenoh.Session, session_name: str) -> Iterator[None]:
    """Within a `with`, an error of Zenoh closes the session and becomes a LinkError."""
    try:
        yield
    except zenoh.ZError as error:
        session.close()
        raise LinkError(f"no telemetry under the session name {session_name!r}: {error}") from error


def _handler(take: OnMessage, bytes_max: int) -> zenoh.handlers.Callback[zenoh.Sample]:
    def on_sample(sample: zenoh.Sample) -> None:
        data = sample.payload.to_bytes()
        if len(data) <= bytes_max:
            take(data)

    return zenoh.handlers.Callback(on_sample, indirect=False)
