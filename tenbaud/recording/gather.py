"""Gathers the overview of a flight while its rows are recorded."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from channel.codec.signals import Signals
from channel.protocol.recording import RecordChannel
from tenbaud.recording.overview import FIELDS, Overview, packed

ROWS_OF_LONG_FLIGHT = 300_000
"""A recording of fewer rows is read again in a second or two."""
BLOCK_ROWS = 512
"""Rows of one topic that are kept as they are, until they are added in one go."""


class OverviewRecorder:
    """Gathers an overview from rows as they are recorded, some at a time."""

    def __init__(self, plant: Signals) -> None:
        self._overview = Overview(plant)
        self._rows: dict[str, tuple[list[int], list[Sequence[object]]]] = {}
        self._places: dict[str, dict[str, int]] = {}
        self._count = 0

    def wants(self, channel: RecordChannel) -> bool:
        """Whether rows of this channel are to be handed to `add`."""
        self._places[channel.topic] = {one.name: place for place, one in enumerate(channel.fields)}
        self._rows.setdefault(channel.topic, ([], []))
        return channel.topic in FIELDS

    def add(self, topic: str, time_ns: int, row: Sequence[object]) -> None:
        times, rows = self._rows[topic]
        times.append(time_ns)
        rows.append(row)
        if len(rows) >= BLOCK_ROWS:
            self._take(topic)

    def metadata(self) -> dict[str, str] | None:
        """Return the overview as metadata of the file; None for a flight that is quickly read again."""
        for topic in self._rows:
            self._take(topic)
        if self._count < ROWS_OF_LONG_FLIGHT:
            return None
        return packed(self._overview)

    def _take(self, topic: str) -> None:
        times, rows = self._rows[topic]
        self._rows[topic] = ([], [])
        self._count += len(rows)
        places = self._places[topic]

        def columns(name: str) -> list[Any] | None:
            place = places.get(name)
            return None if place is None else [row[place] for row in rows]

        if rows:
            self._overview.add(topic, times, columns)
