"""Reads recordings, whole ones and those cut by a crash.

Every file is read from its beginning: of one without an end, a reader that starts from the index at
the end gets nothing.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import orjson
from mcap.exceptions import McapError
from mcap.records import Channel, Footer, Metadata, Schema
from mcap.writer import MCAP0_MAGIC
from zstandard import ZstdError

from channel.recording import RecordChannel
from tenbaud.recording.chunks import Record, records_of_file
from tenbaud.recording.encoding import channel_from_schema
from tenbaud.recording.errors import RecordingError
from tenbaud.recording.writer import RUN_METADATA

Row = dict[str, Any]
"""Field name to value; the values are those of JSON."""

# What a torn end looks like to the reader, depending on where the cut fell: too few bytes for a
# number, for a record, for a compressed chunk, or (a failed checksum, ValueError) blocks that the
# file system had promised and never filled.
_CUT_ERRORS = (McapError, struct.error, ZstdError, ValueError, OverflowError, MemoryError)


class MessageStream:
    """Iterates over (topic, time in ns, row) in the order of the file, in bounded memory.

    What it has met so far is in `channels` and `metadata`. After the last message, `complete`
    tells whether the file was finished properly; False means that it was cut and that the
    messages are those up to the cut.
    """

    def __init__(self, path: Path, topic: str | None = None) -> None:
        """`topic` restricts the stream to one topic; raises RecordingError for a wrong file."""
        _check_head(path)
        self.path = path
        self.complete = False
        self.channels: dict[str, RecordChannel] = {}
        self.metadata: dict[str, dict[str, str]] = {}
        self._topic = topic

    def __iter__(self) -> Iterator[tuple[str, int, Row]]:
        for topic, time_ns, data in self.undecoded():
            yield topic, time_ns, orjson.loads(data)

    def undecoded(self) -> Iterator[tuple[str, int, bytes]]:
        """The same messages as the bytes in the file: for counting, where decoding is wasted."""
        schemas: dict[int, Schema] = {}
        topics: dict[int, str] = {}
        wanted = self._topic
        for record in self._records():
            if isinstance(record, tuple):
                topic = topics[record[0]]
                if wanted is None or wanted == topic:
                    yield topic, record[1], record[2]
            elif isinstance(record, Schema):
                schemas[record.id] = record
            elif isinstance(record, Channel):
                topics[record.id] = record.topic
                self.channels.setdefault(record.topic, self._channel(record, schemas))
            elif isinstance(record, Metadata):
                self.metadata[record.name] = dict(record.metadata)

    def _records(self) -> Iterator[Record]:
        footer_seen = False
        with self.path.open("rb") as stream:
            try:
                for record in records_of_file(stream, self.path.stat().st_size):
                    footer_seen = footer_seen or isinstance(record, Footer)
                    yield record
            except _CUT_ERRORS:
                return
        self.complete = footer_seen

    def _channel(self, record: Channel, schemas: dict[int, Schema]) -> RecordChannel:
        try:
            return channel_from_schema(record.topic, schemas[record.schema_id].data)
        except (ValueError, KeyError, AttributeError, TypeError) as error:
            raise RecordingError(
                f"The recording {self.path} was not written by tenbaud: its topic "
                f"{record.topic!r} is not described as tenbaud does ({error}). "
                "Open it with the program that wrote it."
            ) from error


@dataclass(slots=True)
class TopicSummary:
    """What one topic of a recording holds."""

    channel: RecordChannel
    rows: int = 0
    first_time_ns: int = 0
    last_time_ns: int = 0


@dataclass(slots=True)
class _Survey:
    complete: bool
    metadata: dict[str, dict[str, str]]
    topics: dict[str, TopicSummary] = field(default_factory=dict)


class Recording:
    """One recording, looked at as a whole. The file is read once for its summary, at first need."""

    def __init__(self, path: Path) -> None:
        """Raises RecordingError if there is no such file, or if it is empty or no MCAP file."""
        _check_head(path)
        self.path = path

    @property
    def complete(self) -> bool:
        """False if the file was cut; its rows are then those up to the cut."""
        return self._survey.complete

    @property
    def metadata(self) -> dict[str, str]:
        """What the run said about itself when it began."""
        return self.metadata_record(RUN_METADATA)

    def metadata_record(self, name: str) -> dict[str, str]:
        """A metadata record by name; empty if there is none."""
        return self._survey.metadata.get(name, {})

    @property
    def topics(self) -> dict[str, TopicSummary]:
        """The topics with their rows and time span, in the order of their first row."""
        return self._survey.topics

    def schema(self, topic: str) -> RecordChannel:
        """The topic's fields with types, units and meanings; RecordingError if there is none."""
        if topic not in self.topics:
            raise RecordingError(
                f"The recording {self.path} has no topic {topic!r}. "
                f"It has: {', '.join(self.topics) or 'none at all'}."
            )
        return self.topics[topic].channel

    def rows(self, topic: str) -> Iterator[tuple[int, Row]]:
        """Stream (flight time in ns, row) of one topic; nothing if the topic is absent."""
        for _, time_ns, row in MessageStream(self.path, topic):
            yield time_ns, row

    @cached_property
    def _survey(self) -> _Survey:
        stream = MessageStream(self.path)
        topics: dict[str, TopicSummary] = {}
        for topic, time_ns, _ in stream.undecoded():
            summary = topics.get(topic)
            if summary is None:
                summary = TopicSummary(stream.channels[topic], first_time_ns=time_ns)
                topics[topic] = summary
            summary.rows += 1
            summary.first_time_ns = min(summary.first_time_ns, time_ns)
            summary.last_time_ns = max(summary.last_time_ns, time_ns)
        return _Survey(stream.complete, stream.metadata, topics)


def _check_head(path: Path) -> None:
    try:
        with path.open("rb") as stream:
            head = stream.read(len(MCAP0_MAGIC))
    except OSError as error:
        raise RecordingError(
            f"The recording {path} cannot be read: {error.strerror or error}. "
            "Check the path; `runs/` holds one folder per run."
        ) from error
    if not head:
        raise RecordingError(
            f"The recording {path} is empty: its run ended before anything reached the disk. "
            "There is nothing in it to recover."
        )
    if head != MCAP0_MAGIC:
        raise RecordingError(
            f"{path} is not a recording: an MCAP file begins with other bytes. "
            "Give a file such as transmitter.mcap, or the folder of a run."
        )
