"""Events of a session: records with named fields, for recordings, telemetry and the page.

Programs read the fields. Sentences are made where they are shown (`tenbaud.sentences`).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum, StrEnum

from channel.protocol.endings import End
from channel.protocol.recording import Field, RecordChannel, Recorder


class EventKind(StrEnum):
    """The kinds of events of a flight."""

    STARTED = "started"
    ENDED = "ended"
    REFUSED = "refused"
    DESYNC = "desync"
    REJOIN_ASKED = "rejoin_asked"
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


class Dropped(Enum):
    """Why a symbol or another frame was dropped: the causes of LATE_SYMBOL and STALE."""

    SETTLED = "its slot was already decided"
    PAST_DEADLINE = "it arrived after its deadline"
    FAR_AHEAD = "its slot is too far ahead"
    NOT_DUE = "no due slot has this symbol"
    OUT_OF_BOUNDS = "its contents are out of bounds"


class Presence(Enum):
    """The state of the other end: the causes of PEER."""

    GONE = "it is absent"
    BACK = "it is present again"
    SILENT = "no symbol came within the history"


class Rate(Enum):
    """Changes of the symbol rate: the causes of RATE."""

    MISSED = "too few symbols arrive in time"
    KEPT = "enough symbols arrive again"


class Failing(Enum):
    """Failures of the controller: the causes of CONTROLLER."""

    REFERENCE = "its set-point"
    COMMAND = "its command"


class ByHand(Enum):
    """Changes by a person in flight: the causes of CONTROL."""

    SET_POINT = "a new set-point"
    FOLLOW = "follow the reference"
    PAUSE = "pause before a tick"
    GO_ON = "continue after a pause"
    PACE = "a multiple of real time"
    IMPAIR = "impairments of the line"
    CORRUPT = "one bit of a codec"
    IGNORED = "an impossible change"


@dataclass(frozen=True, slots=True)
class Event:
    """One event. A field without a meaning for its kind is None."""

    kind: EventKind
    sample: int | None = None
    """None: the session's present one"""
    time_ns: int = 0
    """flight time; the session fills it in"""
    tick: int | None = None
    slot: int | None = None
    session: int | None = None
    epoch: int | None = None
    cause: Enum | None = None
    """an `Ending`, a `Why`, or one of the causes that belong to the kind"""
    state: Enum | None = None
    by_peer: bool | None = None
    axis: int | None = None
    number: int | None = None
    value: float | None = None
    limit: float | None = None
    missed_share: float | None = None
    overdue_share: float | None = None
    transmitter_digest: int | None = None
    receiver_digest: int | None = None
    detail: str | None = None
    """for people: what a peer, a device, a plugin or an exception said"""


ASKED = Event(EventKind.REJOIN_ASKED)


def ended_event(end: End) -> Event:
    """Return the event that reports the end of a session."""
    return Event(EventKind.ENDED, cause=end.ending, by_peer=end.by_peer, detail=end.text or None)


Tell = Callable[[Event], None]

EVENT_CHANNEL = RecordChannel(
    "event",
    (
        Field("time_s", "number", "s", "flight time"),
        Field("kind", "string", "", "what kind of event"),
        Field("sample", "integer", "", "sample it belongs to, if any"),
        Field("tick", "integer", "", "tick it belongs to, if any"),
        Field("slot", "integer", "", "slot of the symbol; of a short symbol, its low digits"),
        Field("session", "integer", "", "number of the session that begins or takes over"),
        Field("epoch", "integer", "", "epoch that begins, or that is over"),
        Field("cause", "string", "", "why, by name: an ending, a reason to rejoin, a guard cause ..."),
        Field("state", "string", "", "state of the guard"),
        Field("by_peer", "boolean", "", "whether the other end said so"),
        Field("axis", "integer", "", "measured axis"),
        Field("number", "integer", "", "how many samples or ticks nothing came, or slots ahead"),
        Field("value", "number", "", "angle (rad), symbols per second, pace: what the cause is about"),
        Field("limit", "number", "", "what the value should keep to"),
        Field("missed_share", "number", "", "share of this process' ticks that it missed"),
        Field("overdue_share", "number", "", "share of the other ticks with answers overdue"),
        Field("transmitter_digest", "string", "", "of the sample, where the two differ"),
        Field("receiver_digest", "string", "", "of the sample, where the two differ"),
        Field("detail", "string", "", "for people: what a peer, a device or a plugin said"),
    ),
)


def event_row(event: Event) -> tuple[object, ...]:
    """Return the row of `EVENT_CHANNEL` for an event."""
    return (
        event.time_ns / 1e9,
        event.kind.value,
        *[_plain(getattr(event, name)) for name in _NAMES],
        _hex(event.transmitter_digest),
        _hex(event.receiver_digest),
        event.detail,
    )


def write_event(recorder: Recorder, event: Event) -> None:
    """Record an event under its flight time."""
    recorder.write(EVENT_CHANNEL, event.time_ns, event_row(event))


_NAMES = tuple(field.name for field in EVENT_CHANNEL.fields[2:-3])


def _plain(value: object) -> object:
    if isinstance(value, float) and not math.isfinite(value):
        return None  # JSON has no such number
    return value.name.lower() if isinstance(value, Enum) else value


def _hex(digest: int | None) -> str | None:
    return None if digest is None else f"{digest:016x}"
