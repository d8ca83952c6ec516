"""What a session tells about: one small record each, for the recording and for the person."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from channel.protocol.recording import Field, RecordChannel


class EventKind(StrEnum):
    """Every kind of thing that a flight reports."""

    STARTED = "started"
    ENDED = "ended"
    REFUSED = "refused"
    DESYNC = "desync"
    REJOIN = "rejoin"
    ERASED = "erased"
    LATE_SYMBOL = "late_symbol"
    STALE = "stale"
    MALFORMED = "malformed"
    GUARD = "guard"
    SENSOR = "sensor"
    CONTROLLER = "controller"
    PEER = "peer"
    CONTROL = "control"
    RATE = "rate"


@dataclass(frozen=True, slots=True)
class Event:
    """Something worth telling."""

    kind: EventKind
    time_ns: int
    """flight time"""
    sample: int | None
    text: str
    """a whole sentence, with the numbers in it"""


EVENT_CHANNEL = RecordChannel(
    "event",
    (
        Field("time_s", "number", "s", "flight time"),
        Field("kind", "string", "", "what kind of event"),
        Field("sample", "integer", "", "sample it belongs to, if any"),
        Field("text", "string", "", "what happened"),
    ),
)


def event_row(event: Event) -> tuple[object, ...]:
    """Return the row of `EVENT_CHANNEL` for an event."""
    return (event.time_ns / 1e9, str(event.kind), event.sample, event.text)
