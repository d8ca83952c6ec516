"""How a row becomes a JSON object, and how a channel describes its fields to a reader.

Floats are written by `repr`, the shortest text that reads back as the same 64 bits. JSON has no
infinity and no NaN; both become null.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence

from channel.recording import Field, FieldType, RecordChannel

KEY_PROPERTY = "key"
"""In a schema: the name of the field that counts the rows (tick or sample)."""

# The general encoder is correct for every type but two to three times slower than the functions
# below, which are written for what nearly every row consists of: plain floats.
_encode_any = json.JSONEncoder(allow_nan=False, separators=(",", ":")).encode


def _number(value: object) -> str:
    if type(value) is float:
        # Only infinities and NaN differ from zero when subtracted from themselves.
        return repr(value) if value - value == 0.0 else "null"
    if type(value) is int:
        return repr(value)
    if isinstance(value, float):
        return _number(float(value))
    return _encode_any(value)


def _numbers(values: object) -> str:
    if isinstance(values, list | tuple):
        return "[" + ",".join([_number(value) for value in values]) + "]"
    return _encode_any(values)


def _boolean(value: object) -> str:
    if value is True:
        return "true"
    return "false" if value is False else _encode_any(value)


_ENCODERS: dict[FieldType, Callable[[object], str]] = {
    "number": _number,
    "integer": _number,
    "numbers": _numbers,
    "integers": _numbers,
    "boolean": _boolean,
    "string": _encode_any,
}


def row_encoder(channel: RecordChannel) -> Callable[[Sequence[object]], bytes]:
    """Return a function that writes one row of this channel as a compact JSON object.

    It raises TypeError or ValueError for a row of the wrong length or a value JSON cannot hold.
    """
    names = [json.dumps(field.name).replace("%", "%%") for field in channel.fields]
    template = "{" + ",".join(f"{name}:%s" for name in names) + "}"
    encoders = [_ENCODERS[field.type] for field in channel.fields]

    def encode(row: Sequence[object]) -> bytes:
        texts = [encoder(value) for encoder, value in zip(encoders, row, strict=True)]
        return (template % tuple(texts)).encode()

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
    schema = json.loads(data)
    return RecordChannel(
        topic,
        tuple(_field_from_schema(name, entry) for name, entry in schema["properties"].items()),
    )


def _field_from_schema(name: str, schema: dict[str, object]) -> Field:
    kind = schema["type"]
    items = schema.get("items")
    if kind == "array" and isinstance(items, dict):
        kind = f"{items['type']}s"
    for known in _ENCODERS:
        if known == kind:
            return Field(
                name,
                known,
                unit=str(schema.get("unit", "")),
                description=str(schema.get("description", "")),
                timing=bool(schema.get("timing", False)),
            )
    raise ValueError(f"field {name!r} has the type {kind!r}, which tenbaud does not write")
