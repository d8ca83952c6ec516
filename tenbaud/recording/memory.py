"""A recorder that keeps its rows in memory: for programs that look at a flight without a file."""

from __future__ import annotations

from collections.abc import Container, Sequence
from typing import Any

from channel.protocol.recording import NullRecorder, RecordChannel, Recorder

Row = dict[str, Any]


class MemoryRecorder:
    """Keeps every row, by topic, and hands each on to the recorder `also`, if there is one.

    With `topics` it keeps the rows of these alone.
    """

    def __init__(self, also: Recorder | None = None, topics: Container[str] | None = None) -> None:
        self._also = also or NullRecorder()
        self._topics = topics
        self._names: dict[str, list[str]] = {}
        self._rows: dict[str, list[Sequence[Any]]] = {}

    def write(self, channel: RecordChannel, time_ns: int, row: Sequence[object]) -> None:
        """Keep one row, its values in the order of `channel.fields`."""
        if self._topics is None or channel.topic in self._topics:
            rows = self._rows.get(channel.topic)
            if rows is None:
                rows = self._rows[channel.topic] = []
                self._names[channel.topic] = [field.name for field in channel.fields]
            rows.append(row)
        self._also.write(channel, time_ns, row)

    @property
    def rows(self) -> dict[str, list[Row]]:
        """The rows of every topic, each a dictionary by the names of its fields."""
        return {topic: self.topic(topic) for topic in self._rows}

    def topic(self, topic: str) -> list[Row]:
        """Return the rows of one topic; none where nothing was recorded under it."""
        names = self._names.get(topic, [])
        return [dict(zip(names, row, strict=True)) for row in self._rows.get(topic, [])]

    def taken(self, topic: str) -> list[Sequence[Any]]:
        """Return the rows of one topic as they were written, and keep them no longer."""
        return self._rows.pop(topic, [])

    def column(self, topic: str, name: str) -> list[Any]:
        """Return one field of every row of a topic; none where nothing was recorded under it."""
        if topic not in self._rows:
            return []
        place = self._names[topic].index(name)
        return [row[place] for row in self._rows[topic]]
