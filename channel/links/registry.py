"""The kinds of links: one line for each, and those of installed packages beside them."""

from __future__ import annotations

from channel.links.kind import LinkKind
from channel.registry import Registry, RegistryError

LINKS = Registry(
    "link.kind",
    "tenbaud.links",
    {
        "zenoh": "channel.links.zenoh.kind:ZenohKind",
        "serial": "channel.links.serial.kind:SerialKind",
        "memory": "channel.links.kind:MemoryKind",
    },
    classes=False,
)


def link_kind(name: str) -> LinkKind:
    """Return a kind of link; RegistryError for a name that nobody offers, or offers wrongly."""
    found = LINKS.load(name)
    kind = found() if isinstance(found, type) and issubclass(found, LinkKind) else None
    if kind is None:
        raise RegistryError(
            f"link.kind = {name!r}: {found!r} is no subclass of channel.links.kind.LinkKind"
        )
    return kind
