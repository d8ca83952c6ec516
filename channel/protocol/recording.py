"""Descriptions of a node's records, so that a recording carries names and units.

A node declares its channels as `RecordChannel`s and hands rows to a `Recorder`. It never learns
where they go: the tool puts them into a file from another thread, a test into a list.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, Protocol

FieldType = Literal["number", "integer", "string", "boolean", "numbers", "integers"]
"""JSON types; the plural ones are arrays. Any field may also be null (None)."""


@dataclass(frozen=True, slots=True)
class Field:
    """One column of a recorded channel."""

    name: str
    type: FieldType
    unit: str = ""
    description: str = ""
    timing: bool = False
    """True for wall-clock readings and what depends on the kind of line: two runs of one flight need
    not share them."""


@dataclass(frozen=True, slots=True)
class RecordChannel:
    """A named stream of rows. By convention the first field is the tick or sample that a row is of."""

    topic: str
    fields: tuple[Field, ...]


class Recorder(Protocol):
    """Takes rows without ever waiting: a full queue drops the row and counts it."""

    def write(self, channel: RecordChannel, time_ns: int, row: Sequence[object]) -> None:
        """Keep one row, its values in the order of `channel.fields`.

        `time_ns` is the flight's time (zero at tick 0), in nanoseconds.
        """


class NullRecorder:
    """Keeps nothing: for flights flown without a recording."""

    def write(self, channel: RecordChannel, time_ns: int, row: Sequence[object]) -> None:
        """Forget the row."""
