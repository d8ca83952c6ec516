"""Zenoh as a kind of link. Zenoh itself is loaded when an end is opened."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from channel.links.base import Link
from channel.links.endpoints import free_endpoint
from channel.links.kind import LinkEnd, LinkKind, LinkSettings, Meeting


class ZenohKind(LinkKind):
    """Two processes, or one receiver and many transmitters, wherever Zenoh's endpoints are."""

    serves_many = True

    def uses_addresses(self, settings: LinkSettings) -> bool:
        """Return True: endpoints and keys are Zenoh's."""
        return True

    def open(self, end: LinkEnd) -> Link:
        from channel.links.zenoh.link import ZenohLink

        return ZenohLink(
            end.role,
            end.settings.session,
            **end.place,
            best_effort=end.settings.best_effort,
            patience_s=end.settings.peer_timeout_s,
            should_stop=end.should_stop,
        )

    @contextmanager
    def meeting(self, settings: LinkSettings) -> Iterator[tuple[Meeting, Meeting]]:
        """Join two processes at a free port of this machine."""
        endpoint = free_endpoint()
        yield Meeting(connect=endpoint), Meeting(listen=endpoint)
