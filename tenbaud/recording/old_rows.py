"""Rows of earlier versions, read as those of today: old names occur only here.

Up to wire version 1 an event was kind, sample and a sentence. The fields of today are filled from it,
and the sentence stays, as `text`, for people. Fields of ticks and epochs had units in their
names, and there was one set-point. A sample did not say what its symbols were about. Outputs that are
states had numbers for names and no unit, and signals no picture and no sums of states.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable
from dataclasses import replace
from typing import Any

from channel.codec.models.pitch import PITCH_SIGNALS
from channel.codec.signals import Signal, Signals
from channel.protocol.events import EVENT_CHANNEL
from channel.protocol.recording import Field, RecordChannel

NEW_NAMES = {
    "measured_rad": "measured",
    "true_rad": "true",
    "commanded_volts": "commanded",
    "applied_volts": "applied",
    "reference_rad": "reference",
    "command_volts": "command",
    "hold_volts": "hold",
    "strength_rad2_per_s3": "density",
}
"""Field of a tick, an epoch or the gauge -> its name today."""
RENAMED_TOPICS = ("tick", "epoch", "gap")

SIGNALS_WITHOUT = PITCH_SIGNALS
"""Of a recording that does not describe its signals: all flights were of the pitch."""

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
    if channel.fields == OLD_EVENT_CHANNEL.fields:
        return _FILLED
    if channel.topic == "sample" and _lacks_about([one.name for one in channel.fields]):
        return RecordChannel("sample", (*channel.fields, Field("about", "integers")))
    if channel.topic not in RENAMED_TOPICS:
        return channel
    return RecordChannel(channel.topic, tuple(_field_of_today(one) for one in channel.fields))


def _field_of_today(one: Field) -> Field:
    is_plain = one.name == "reference_rad" and one.type == "number"
    return replace(
        one, name=NEW_NAMES.get(one.name, one.name), type="numbers" if is_plain else one.type
    )


def names_of_today(names: Iterable[str]) -> list[str]:
    """Return the names of a row's fields as they are read."""
    found = [NEW_NAMES.get(name, name) for name in names]
    return [*found, "about"] if _lacks_about(found) else found


def _lacks_about(names: Collection[str]) -> bool:
    """Whether these are the fields of a sample that does not say what its symbols were about."""
    return "word_sent" in names and "about" not in names


def rows_of_today(topic: str, rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return rows of one file with the fields of today; those that have them as they are."""
    if topic == "event":
        return [_filled(row) for row in rows]
    if topic == "sample" and rows and _lacks_about(rows[0]):
        return [{**row, "about": None} for row in rows]
    if topic in RENAMED_TOPICS and rows and not NEW_NAMES.keys().isdisjoint(rows[0]):
        return [_renamed(row) for row in rows]
    return rows


def is_same_plant(recorded: Signals, today: Signals) -> bool:
    """Return whether recorded signals are these, as far as the version that wrote them could say."""
    if len(recorded.outputs) != len(today.outputs):
        return False
    outputs = zip(recorded.outputs, today.outputs, strict=True)
    states = zip(recorded.output_states, today.output_states, strict=True)
    return (
        (recorded.states, recorded.inputs) == (today.states, today.inputs)
        and recorded.picture in ("", today.picture)
        and recorded.output_rows in ((), today.output_rows)
        and all(then in (None, now) for then, now in states)
        and all(_is_same_output(at, then, now) for at, (then, now) in enumerate(outputs, 1))
    )


def _is_same_output(number: int, then: Signal, now: Signal) -> bool:
    name = now.name if then.name == f"output_{number}" else then.name
    return replace(then, name=name, unit=then.unit or now.unit) == now


def _renamed(row: dict[str, Any]) -> dict[str, Any]:
    row = {NEW_NAMES.get(name, name): value for name, value in row.items()}
    if "reference" in row and not isinstance(row["reference"], list):
        row["reference"] = [row["reference"]]
    return row


def _filled(row: dict[str, Any]) -> dict[str, Any]:
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
