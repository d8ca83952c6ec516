"""Both ends in one process: the receiver's endpoint itself is the transmitter's peer."""

from __future__ import annotations

from channel.errors import LinkError
from channel.links.base import Link
from channel.links.kind import LinkEnd, LinkKind


class MemoryKind(LinkKind):
    """No line at all; the flight is as fast as it computes."""

    in_process = True

    def open(self, end: LinkEnd) -> Link:
        """Refuse: one end by itself has nobody to talk to."""
        raise LinkError(
            "link.kind = memory joins two ends in one process: `tenbaud demo --link memory`"
        )
