"""Events as recordings held them up to wire version 1: kind, sample and a sentence.

The fields of today are filled from there, so that readers of an event need not know its version.
The sentence stays, as `text`, for people.
"""

from __future__ import annotations

import re
from typing import Any

from channel.protocol.events import EVENT_CHANNEL
from channel.protocol.recording import Field, RecordChannel

OLD_EVENT_CHANNEL = RecordChannel(
    "event",
    (
        Field("time_s", "number", "s", "flight time"),
        Field("kind", "string", "", "what kind of event"),
        Field("sample", "integer", "", "sample it belongs to, if any"),
        Field("text", "string", "", "what happened"),
    ),
)
_FILLED = RecordChannel("event", (*EVENT_CHANNEL.fields, OLD_EVENT_CHANNEL.fields[-1]))
_NOTHING = {field.name: None for field in _FILLED.fields}

_ASKED = "asking for a new epoch after"
_BEGINS = re.compile(r"session ([0-9a-f]{8}), epoch (\d{1,5}), begins at sample \d")
_DIFFERS = re.compile(r"transmitter ([0-9a-f]{16}), receiver ([0-9a-f]{16})")
_GUARD = re.compile(r"guard (holding|ramping|latched|ready)")


def of_today(channel: RecordChannel) -> RecordChannel:
    """Return the channel as its rows will be read."""
    return _FILLED if channel.fields == OLD_EVENT_CHANNEL.fields else channel


def filled(row: dict[str, Any]) -> dict[str, Any]:
    """Return an event with the fields of today; one that has them as it is."""
    if "text" not in row or "cause" in row:
        return row
    row = {**_NOTHING, **row}
    kind, text = row["kind"], row["text"]
    if not isinstance(text, str):
        return row
    if kind == "rejoin" and _ASKED in text:
        row["kind"] = "rejoin_asked"
    elif kind in ("started", "rejoin") and (begins := _BEGINS.match(text)):
        row["session"], row["epoch"] = int(begins[1], 16), int(begins[2])
    elif kind == "desync" and (differs := _DIFFERS.search(text)):
        row["transmitter_digest"], row["receiver_digest"] = differs[1], differs[2]
    elif kind == "guard" and (guard := _GUARD.match(text)):
        row["state"] = guard[1]
    return row
