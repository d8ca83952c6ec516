"""How a row becomes a JSON object, and how a channel describes its fields to a reader.

Floats are written as the shortest text that reads back as the same 64 bits. JSON has no infinity and
no NaN; both become null. orjson does it some ten times faster than the standard library, which counts
at 30,000 rows a second beside a flight on the virtual clock.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from typing import TYPE_CHECKING, get_args

import orjson

from channel.codec.signals import Signals
from channel.protocol.recording import Field, FieldType, RecordChannel
from tenbaud.recording.errors import RecordingError
from tenbaud.recording.old_rows import SIGNALS_WITHOUT

if TYPE_CHECKING:
    from pydantic import TypeAdapter

RUN_METADATA = "run"
"""Metadata of a recording: the run's description at its start."""
END_METADATA = "recorder"
"""Written when a recording is finished only: how many rows were written and dropped, and why."""
OVERVIEW_METADATA = "overview"
"""The data of a long flight's figure (`overview.py`)."""
SIGNALS_KEY = "signals"
"""In the metadata of a run: the model's names of states, inputs and outputs."""
SIGNALS_MAX = 128
UNIT_LENGTH_MAX = 64
KEY_PROPERTY = "key"
"""In a schema: the name of the field that counts the rows (tick or sample)."""

_FIELD_TYPES: tuple[FieldType, ...] = get_args(FieldType)


def row_encoder(channel: RecordChannel) -> Callable[[Sequence[object]], bytes]:
    """Return a function that writes one row of this channel as a compact JSON object.

    It raises TypeError or ValueError for a row of the wrong length or a value JSON cannot hold.
    """
    names = [field.name for field in channel.fields]

    def encode(row: Sequence[object]) -> bytes:
        return orjson.dumps(dict(zip(names, row, strict=True)))

    return encode


def channel_schema(channel: RecordChannel) -> bytes:
    """The JSON schema stored with the channel, with each field's unit and meaning.

    Any field may also be null, but the schema names the plain type alone: viewers that plot by
    schema expect one word there, not a list of alternatives.
    """
    schema = {
        "title": channel.topic,
        "type": "object",
        KEY_PROPERTY: channel.fields[0].name,
        "properties": {field.name: _field_schema(field) for field in channel.fields},
    }
    return json.dumps(schema).encode()


def _field_schema(field: Field) -> dict[str, object]:
    schema: dict[str, object] = {"type": field.type}
    if field.type in ("numbers", "integers"):
        schema = {"type": "array", "items": {"type": field.type.removesuffix("s")}}
    if field.unit:
        schema["unit"] = field.unit
    if field.description:
        schema["description"] = field.description
    if field.timing:
        schema["timing"] = True
    return schema


def channel_from_schema(topic: str, data: bytes) -> RecordChannel:
    """The inverse of `channel_schema`; raises ValueError or KeyError for a foreign schema."""
    schema = orjson.loads(data)
    return RecordChannel(
        topic, tuple(_field_from_schema(name, entry) for name, entry in schema["properties"].items())
    )


def _field_from_schema(name: str, schema: dict[str, object]) -> Field:
    kind = schema["type"]
    items = schema.get("items")
    if kind == "array" and isinstance(items, dict):
        kind = f"{items['type']}s"
    for known in _FIELD_TYPES:
        if known == kind:
            return Field(
                name,
                known,
                unit=str(schema.get("unit", "")),
                description=str(schema.get("description", "")),
                timing=bool(schema.get("timing", False)),
            )
    raise ValueError(f"field {name!r} has the type {kind!r}, which tenbaud does not write")


def signals_text(plant: Signals) -> str:
    """Return the description of a plant's signals as a recording holds it."""
    return _signals_adapter().dump_json(plant, exclude_defaults=True).decode()


def recorded_signals(metadata: Mapping[str, str]) -> Signals:
    """Return the signals that a recording describes; RecordingError for an invalid description."""
    text = metadata.get(SIGNALS_KEY)
    if text is None:
        return SIGNALS_WITHOUT
    try:
        plant = _signals_adapter().validate_json(text)
    except ValueError as error:
        raise RecordingError(f"The recording's description of the signals is wrong: {error}") from error
    signals = (*plant.states, *plant.inputs, *plant.outputs)
    texts = [one.unit + one.group for one in signals]
    if len(signals) > SIGNALS_MAX or any(len(text) > UNIT_LENGTH_MAX for text in texts):
        raise RecordingError("The recording describes more signals, or longer units, than a plant has.")
    if not all(text.isprintable() for text in texts):
        raise RecordingError("A unit or group in the recording's description is not plain text.")
    return plant


@cache
def _signals_adapter() -> TypeAdapter[Signals]:
    from pydantic import TypeAdapter

    return TypeAdapter(Signals)
