"""Properties of a kind of link: how an end is opened, and how a flight over it differs.

A kind is a class without arguments, named in `channel.links.registry` or by an entry point of the group
`tenbaud.links`. It imports its transport inside `open`, so that a flight over another kind does
not load it.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any, Protocol, TypedDict

from channel.codec.codec import Codec
from channel.errors import LinkError
from channel.links.base import Link, Role
from channel.links.security import Security
from channel.protocol.terms import Terms


class NodePlace(TypedDict, total=False):
    """Address and access rules of a Zenoh node."""

    listen: tuple[str, ...]
    connect: tuple[str, ...]
    router: tuple[str, ...]
    scouting: bool
    insecure: bool
    security: Security | None


class LinkSettings(Protocol):
    """The configuration's section `link`; `options` are those of an external kind."""

    @property
    def session(self) -> str: ...
    @property
    def peer_timeout_s(self) -> float: ...
    @property
    def port(self) -> str: ...
    @property
    def line_rate_baud(self) -> int: ...
    @property
    def downlink(self) -> str: ...
    @property
    def downlink_rate_baud(self) -> int: ...
    @property
    def best_effort(self) -> bool: ...
    @property
    def options(self) -> Mapping[str, Any]: ...


@dataclass(frozen=True, slots=True)
class LinkEnd:
    """One end of a flight, as far as opening its link goes."""

    role: Role
    settings: LinkSettings
    terms: Terms
    codec: Codec
    place: NodePlace
    """addresses and credentials from the command line"""
    should_stop: Callable[[], bool]
    """asked while the link waits for something"""


@dataclass(frozen=True, slots=True)
class Meeting:
    """How one of two processes on this machine finds the other."""

    settings: Mapping[str, Any] = field(default_factory=dict)
    """fields of the section `link`, set for this end"""
    listen: str = ""
    connect: str = ""


class LinkKind(ABC):
    """A kind of link; the defaults here are those of an ordinary one."""

    in_process = False
    """both ends are in one process, on the virtual clock: no link is opened, nothing looks on"""
    serves_many = False
    """one receiver may serve many sessions over it"""
    changes_terms = False
    """bytes take time on the line, so `terms` changes the flight"""
    carries_slots = True
    """a symbol arrives with the number of its slot, whole and checked; without it, a symbol that comes
    after its deadline cannot be distinguished from a later one's"""

    def uses_addresses(self, settings: LinkSettings) -> bool:
        """Return whether ends meet at Zenoh endpoints, with its keys: `--listen`, `--connect` ..."""
        return False

    def where(self, settings: LinkSettings) -> tuple[str, ...]:
        """Return the places of this end that are not endpoints, such as ports, to be shown."""
        return ()

    def check(self, settings: LinkSettings, insecure: bool) -> None:  # noqa: B027, most need none
        """Raise LinkError for settings that cannot be opened or are not safe."""

    def terms(self, settings: LinkSettings, codec: Codec, terms: Terms) -> Terms:
        """Return the terms with the line's effect; ValueError if the line cannot carry the flight."""
        return terms

    @abstractmethod
    def open(self, end: LinkEnd) -> Link:
        """Return one open end; LinkError where that fails."""

    @contextmanager
    def meeting(self, settings: LinkSettings) -> Iterator[tuple[Meeting, Meeting]]:
        """Within a `with`, tell transmitter and receiver of `tenbaud demo` where they meet."""
        raise LinkError(
            "this kind of link does not join two processes by itself; start `tenbaud receive` and "
            "`tenbaud transmit` with the same settings"
        )
        yield Meeting(), Meeting()


class MemoryKind(LinkKind):
    """No line at all; the flight is as fast as it computes."""

    in_process = True

    def open(self, end: LinkEnd) -> Link:
        """Refuse: one end by itself has nobody to talk to."""
        raise LinkError(
            "link.kind = memory joins two ends in one process: `tenbaud demo --link memory`"
        )
