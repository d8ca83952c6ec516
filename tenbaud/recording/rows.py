"""Rows of a recording checked against their channel's declaration, many at a time.

Every row has all declared fields, each with a value of its type or null, and a whole number, not null,
in the field that counts the rows; `NEVER_NULL` names further fields.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain
from typing import Any, NamedTuple

import orjson

from channel.protocol.recording import Field, RecordChannel
from tenbaud.recording.errors import RecordingError
from tenbaud.recording.kinds import KINDS
from tenbaud.recording.old_rows import OLD_EVENT_CHANNEL, names_of_today, rows_of_today

Row = dict[str, Any]
"""Field name to value; the values are those of JSON."""

KEYS = ("tick", "sample", "slot")
"""Fields that count the rows of a topic, where they are its first one."""
KEY_MAX = 1 << 53
ROWS_AT_ONCE = 2000

KNOWN = (*(kind.channel for topics in KINDS.values() for kind in topics.values()), OLD_EVENT_CHANNEL)
"""The rows that this version's ends write, and the changed ones of earlier versions."""

NEVER_NULL = {
    ("epoch", "epoch"),
    *(("epoch", name) for name in ("state", "coder", "hold")),
    *(("two_way", name) for name in ("epoch", "state")),
    *(("confirmed", name) for name in ("symbols", "commands", "doubt", "lag_samples")),
    *(("sample", name) for name in ("state", "coder", "digest")),
    *(("tick", name) for name in ("live_state", "command", "applied")),
    *(("symbol", name) for name in ("symbol", "arrived_ns", "taken", "wire_bytes")),
}
"""(topic, field) that no end ever leaves out; those that read them need not ask."""

_NONE = type(None)


class _Type(NamedTuple):
    """The values of a field's type, besides null."""

    words: str
    values: frozenset[type]
    items: frozenset[type] | None = None
    """of a list"""


_TYPES: dict[str, _Type] = {
    "number": _Type("a number", frozenset({float, int})),
    "integer": _Type("a whole number", frozenset({int})),
    "string": _Type("a text", frozenset({str})),
    "boolean": _Type("true or false", frozenset({bool})),
    "numbers": _Type("a list of numbers", frozenset({list}), frozenset({float, int, _NONE})),
    "integers": _Type("a list of whole numbers", frozenset({list}), frozenset({int, _NONE})),
}


def channel_of_names(data: bytes) -> RecordChannel | None:
    """Return the channel of this version whose rows have the names that this row has, if there is one.

    For the rest of a file whose own description was in the part that is damaged.
    """
    try:
        row = orjson.loads(data)
    except ValueError:
        return None
    names = names_of_today(row) if isinstance(row, dict) else []
    for channel in KNOWN:
        if names == [one.name for one in channel.fields]:
            return channel
    return None


def check_channel(channel: RecordChannel) -> None:
    """Raise ValueError where a topic of ours has a field of another type than we give it."""
    if not channel.fields:
        raise ValueError("it has no fields")
    types: dict[str, set[str]] = {}
    for known in KNOWN:
        if known.topic == channel.topic:
            for one in known.fields:
                types.setdefault(one.name, set()).add(one.type)
    for one in channel.fields:
        known_types = types.get(one.name)
        if known_types and one.type not in known_types:
            wanted = " or ".join(_TYPES[kind].words for kind in sorted(known_types))
            raise ValueError(f"its field {one.name!r} is {_TYPES[one.type].words}, here it is {wanted}")


class RowDecoder:
    """Turns the texts of one topic into rows; keeps count, so that an error can name the row."""

    def __init__(self, where: str, channel: RecordChannel, names: Sequence[str] | None = None) -> None:
        """`where` names the file; `names` are the fields that will be used, all if not given."""
        self._where = where
        self._channel = channel
        fields = channel.fields
        self._fields = [one for one in fields if names is None or one.name in names]
        self._count = 0

    def decode(self, texts: Sequence[bytes]) -> list[Row]:
        """Return the next rows; RecordingError for one that contradicts the channel's declaration."""
        rows: list[Row] = []
        for start in range(0, len(texts), ROWS_AT_ONCE):
            some = texts[start : start + ROWS_AT_ONCE]
            rows += self._checked(some)
            self._count += len(some)
        return rows

    def _checked(self, texts: Sequence[bytes]) -> list[Row]:
        try:
            # One parse for many rows takes half the time of one per row.
            rows = orjson.loads(b"[" + b",".join(texts) + b"]")
        except ValueError:
            rows = None
        if rows is None or len(rows) != len(texts):
            rows = [self._parsed(index, text) for index, text in enumerate(texts)]
        if set(map(type, rows)) - {dict}:
            bad = next(index for index, row in enumerate(rows) if type(row) is not dict)
            raise self._error(bad, "is no JSON object")
        rows = rows_of_today(self._channel.topic, rows)
        for one in self._fields:
            self._check(one, rows)
        return rows

    def _parsed(self, index: int, text: bytes) -> Any:
        try:
            return orjson.loads(text)
        except ValueError as error:
            raise self._error(index, f"is no JSON ({error})") from error

    def _check(self, one: Field, rows: list[Row]) -> None:
        name = one.name
        try:
            values = [row[name] for row in rows]
        except KeyError:
            bad = next(index for index, row in enumerate(rows) if name not in row)
            raise self._error(bad, f"lacks the field {name!r}") from None
        never_null = (self._channel.topic, name) in NEVER_NULL or self._is_key(one)
        wrong = set(map(type, values)) - _TYPES[one.type].values - (set() if never_null else {_NONE})
        if wrong:
            bad = next(index for index, value in enumerate(values) if type(value) in wrong)
            raise self._error(
                bad, f"has {values[bad]!r:.60} for {name!r}: not {_TYPES[one.type].words}"
            )
        if self._is_key(one) and not -KEY_MAX <= min(values) <= max(values) <= KEY_MAX:
            bad = max(range(len(values)), key=lambda index: abs(values[index]))
            raise self._error(bad, f"has {values[bad]} for {name!r}, which no flight reaches")
        allowed = _TYPES[one.type].items
        if allowed is not None:
            self._check_items(one, values, allowed - {_NONE} if never_null else allowed)

    def _is_key(self, one: Field) -> bool:
        return one.name in KEYS and one is self._channel.fields[0]

    def _check_items(self, one: Field, values: list[Any], allowed: frozenset[type]) -> None:
        items = chain.from_iterable(value for value in values if value is not None)
        wrong = set(map(type, items)) - allowed
        if wrong:
            for index, value in enumerate(values):
                if value is not None and wrong.intersection(map(type, value)):
                    text = f"has {value!r:.60} for {one.name!r}: not {_TYPES[one.type].words}"
                    raise self._error(index, text)

    def _error(self, index: int, what: str) -> RecordingError:
        return RecordingError(
            f"{self._where}: row {self._count + index} of the topic {self._channel.topic!r} {what}. "
            "tenbaud writes no such row: the file was changed, or another program wrote it."
        )
