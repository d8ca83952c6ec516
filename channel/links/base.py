"""The interface of a link: it carries whole byte messages between the two ends, in order if possible.

A link promises little: a message may be lost in silence when the peer is not there. Index, epoch and
acknowledgement belong to the sessions. A link is used by one thread.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import Counter
from dataclasses import dataclass, field
from typing import Literal, Self

from channel.protocol.wire import DATAGRAM, Wire

Role = Literal["transmitter", "receiver"]


@dataclass(slots=True)
class LinkCounts:
    """Counts of the messages that a link carried and lost."""

    messages_out: int = 0
    bytes_out: int = 0
    messages_in: int = 0
    bytes_in: int = 0
    dropped: Counter[str] = field(default_factory=Counter)
    """messages not taken, by reason"""
    refused: Counter[str] = field(default_factory=Counter)
    """connections that were turned away, by reason"""
    reconnects: int = 0
    """times that a line which had gone came back"""
    line_bytes_out: int = 0
    """on lines that we frame ourselves: every byte put there, framing and notices included"""
    line_bytes_in: int = 0


class Link(ABC):
    """One end of a link; the methods that are not abstract are the usual behaviour."""

    name = ""
    """of the kind of link, for summaries"""
    wire: Wire = DATAGRAM
    """how frames look on this kind of line"""
    start_ns: int | None = None
    """how soon after the answer to its request a flight has to begin; None: at any time"""

    def __init__(self) -> None:
        self._counts = LinkCounts()

    @property
    def counts(self) -> LinkCounts:
        return self._counts

    @abstractmethod
    def send(self, data: bytes) -> None:
        """Put one message on the line; which path it takes there, the wire can tell from its bytes."""

    @abstractmethod
    def receive(self, timeout_s: float) -> bytes | None:
        """Return the next message, or None after `timeout_s` seconds (0: only what is there)."""

    @abstractmethod
    def peer_present(self) -> bool:
        """Return whether the other end is known to be there now."""

    def trouble(self) -> str:
        """Return the fault of this end's line itself, such as a lost port; else nothing."""
        return ""

    @abstractmethod
    def close(self) -> None:
        """Give the line back; may be called more than once."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
