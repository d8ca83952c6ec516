"""Events as recordings held them up to wire version 1: kind, sample and a sentence.

The fields of today are taken from there, so that whoever reads an event need not know how old it is.
The sentence stays, as `text`, for people.
"""

from __future__ import annotations

import re
from typing import Any

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

_BEGINS = re.compile(r"session ([0-9a-f]{8}), epoch (\d{1,5}), begins at sample (\d{1,10})")
_DIFFERS = re.compile(r"sample (\d{1,10}): transmitter ([0-9a-f]{16}), receiver ([0-9a-f]{16})")
_ASKED = "asking for a new epoch after"
_GUARD = re.compile(r"guard (holding|ramping|latched|ready)")


def is_old(channel: RecordChannel) -> bool:
    """Return whether rows of this channel are events with a sentence instead of fields."""
    names = {field.name for field in channel.fields}
    return channel.topic == OLD_EVENT_CHANNEL.topic and "text" in names and "cause" not in names


def filled(row: dict[str, Any]) -> dict[str, Any]:
    """Return an old event with the fields that its sentence gives."""
    kind, text = row.get("kind"), row.get("text") or ""
    if kind == "rejoin" and _ASKED in text:
        return {**row, "kind": "rejoin_asked"}
    if kind in ("started", "rejoin") and (begins := _BEGINS.search(text)):
        session, epoch, sample = begins.groups()
        return {**row, "session": int(session, 16), "epoch": int(epoch), "sample": int(sample)}
    if kind == "desync" and (differs := _DIFFERS.search(text)):
        _, transmitter, receiver = differs.groups()
        return {**row, "transmitter_digest": transmitter, "receiver_digest": receiver}
    if kind == "guard" and (guard := _GUARD.match(text)):
        return {**row, "state": guard.group(1)}
    return row
