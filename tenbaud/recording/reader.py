"""Reads recordings: complete, truncated and untrusted ones.

Every file is read from its beginning: in a truncated file there is no index at the end to start from.
Damaged parts are skipped and listed in `MessageStream.holes`; content that tenbaud cannot have written
is a RecordingError. Every command reads recordings with this module.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import BinaryIO

from mcap.records import Channel, Footer, Metadata, MetadataIndex, Schema
from mcap.writer import MCAP0_MAGIC

from channel.protocol.recording import RecordChannel
from tenbaud.recording.chunks import Damage, Described, RawMessage, metadata_at, summary_of_file
from tenbaud.recording.encoding import END_METADATA, RUN_METADATA, channel_from_schema
from tenbaud.recording.errors import RecordingError
from tenbaud.recording.folder import open_plain
from tenbaud.recording.holes import HOLES_METADATA, Hole, HoleFinder, unpacked_holes
from tenbaud.recording.notes import recording_notes
from tenbaud.recording.old_rows import of_today
from tenbaud.recording.resync import blocks_of_file
from tenbaud.recording.rows import Row, RowDecoder, channel_of_names, check_channel
from tenbaud.recording.table import Filling, Table

METADATA_RECORDS_MAX = 100


class MessageStream:
    """Iterates over (topic, time in ns, row) in the order of the file, in bounded memory.

    `channels` and `metadata` are those found so far. After the last message, `complete` tells whether
    the file was finished properly and read completely, and `holes` lists the missing rows between
    present ones.
    """

    def __init__(self, path: Path, size: int | None = None) -> None:
        """`size` restricts it to the first bytes of a file that grows. RecordingError: a wrong file."""
        with open_recording(path) as stream:
            _check_head(path, stream.read(len(MCAP0_MAGIC)))
        self.path = path
        self.size = size
        self.complete = False
        self.channels: dict[str, RecordChannel] = {}
        self.metadata: dict[str, dict[str, str]] = {}
        self.strays = 0
        """rows of channels that the file does not describe"""
        self._schemas: dict[int, Schema] = {}
        self._topics: dict[int, str | None] = {}
        self._finder = HoleFinder()
        self._ended = False

    @property
    def holes(self) -> list[Hole]:
        """The gaps, including those that an earlier recovery found."""
        found = self._finder.holes(self._topics, self.channels, self._ended)
        return unpacked_holes(self.metadata.get(HOLES_METADATA, {})) + found

    def __iter__(self) -> Iterator[tuple[str, int, Row]]:
        decoders: dict[str, RowDecoder] = {}
        for topic, time_ns, data in self.undecoded():
            if topic not in decoders:
                decoders[topic] = RowDecoder(str(self.path), self.channels[topic])
            yield topic, time_ns, decoders[topic].decode((data,))[0]

    def undecoded(self) -> Iterator[tuple[str, int, bytes]]:
        """The same messages as the bytes in the file: for counting, where decoding is wasted."""
        for messages in self._blocks():
            for channel_id, time_ns, data in messages:
                topic = self._topics[channel_id]
                if topic is not None:
                    yield topic, time_ns, data

    def texts(self) -> Iterator[dict[str, tuple[list[int], list[bytes]]]]:
        """Yield block by block what each topic has there: times in ns and undecoded rows."""
        for messages in self._blocks():
            block: dict[str, tuple[list[int], list[bytes]]] = {}
            for channel_id, time_ns, data in messages:
                topic = self._topics[channel_id]
                if topic is not None:
                    if topic not in block:
                        block[topic] = ([], [])
                    times, texts = block[topic]
                    times.append(time_ns)
                    texts.append(data)
            yield block

    def _blocks(self) -> Iterator[list[RawMessage]]:
        """Yield the messages of each block, its channels known."""
        footer_seen = damaged = False
        with open_recording(self.path) as stream:
            there = os.fstat(stream.fileno()).st_size
            size = there if self.size is None else min(there, self.size)
            for block in blocks_of_file(stream, size):
                if isinstance(block, Damage):
                    damaged = True
                    # The recorder says that last: no row comes behind it.
                    if END_METADATA not in self.metadata:
                        self._finder.on_damage(block)
                    continue
                for record in block.described:
                    footer_seen = footer_seen or isinstance(record, Footer)
                    self._describe(record)
                if block.messages:
                    self._finder.on_messages(block.messages)
                    self._know(block.messages)
                    yield block.messages
        self._ended = footer_seen
        self.complete = footer_seen and not damaged

    def _describe(self, record: Described) -> None:
        if isinstance(record, Schema):
            self._schemas[record.id] = record
        elif isinstance(record, Channel):
            self._topics[record.id] = record.topic
            if record.topic not in self.channels:
                self.channels[record.topic] = self._channel(record)
        elif isinstance(record, Metadata) and len(self.metadata) < METADATA_RECORDS_MAX:
            self.metadata[record.name] = dict(record.metadata)

    def _know(self, messages: list[RawMessage]) -> None:
        """Determine the rows of a channel whose description is lost."""
        there = {message[0] for message in messages}
        if there - self._topics.keys():
            with open_recording(self.path) as stream:
                for record in summary_of_file(stream, os.fstat(stream.fileno()).st_size):
                    if isinstance(record, Schema) or (
                        isinstance(record, Channel) and record.id not in self._topics
                    ):
                        self._describe(record)
        for channel_id in there - self._topics.keys():
            data = next(message[2] for message in messages if message[0] == channel_id)
            channel = channel_of_names(data)
            self._topics[channel_id] = None if channel is None else channel.topic
            if channel is not None:
                self.channels.setdefault(channel.topic, of_today(channel))
        unknown = {channel_id for channel_id in there if self._topics[channel_id] is None}
        if unknown:
            self.strays += sum(message[0] in unknown for message in messages)

    def _channel(self, record: Channel) -> RecordChannel:
        try:
            channel = of_today(channel_from_schema(record.topic, self._schemas[record.schema_id].data))
            check_channel(channel)
        except (ValueError, KeyError, AttributeError, TypeError) as error:
            raise RecordingError(
                f"The recording {self.path} was not written by tenbaud: its topic "
                f"{record.topic!r} is not described as tenbaud does ({error}). "
                "Open it with the program that wrote it."
            ) from error
        return channel


class Recording:
    """One recording, looked at as a whole. The file is read once for its summary, at first need."""

    def __init__(self, path: Path) -> None:
        """Raises RecordingError if there is no such file, or if it is empty or no MCAP file."""
        MessageStream(path)
        self.path = path
        self._tables: dict[str, Table] = {}

    @property
    def complete(self) -> bool:
        """False if the file was cut or damaged; its rows are then those that are whole."""
        return self._survey.complete

    @cached_property
    def holes(self) -> list[Hole]:
        """The gaps between rows."""
        return self._survey.holes

    @property
    def strays(self) -> int:
        """Rows that nothing in the file describes, and that are left out."""
        return self._survey.strays

    @property
    def metadata(self) -> dict[str, str]:
        """The metadata that the run wrote at its start."""
        return self.metadata_record(RUN_METADATA)

    def metadata_record(self, name: str) -> dict[str, str]:
        return self._survey.metadata.get(name, {})

    @cached_property
    def end(self) -> dict[str, str]:
        """The recorder's counts at its end: rows written and dropped; empty if it was truncated."""
        end = self.metadata_record(END_METADATA)
        for name in ("rows_written", "rows_dropped", "rows_recovered"):
            count = end.get(name, "0")
            if not (count.isascii() and count.isdigit() and len(count) < 19):
                raise RecordingError(
                    f"{self.path}: its end says {count!r:.40} for {name}, which is no count. "
                    "tenbaud writes no such end: the file was changed, or another program wrote it."
                )
        return end

    @property
    def notes(self) -> list[str]:
        """Notes to read before trusting results from this recording."""
        return recording_notes(self.path, self.metadata, self.complete, self.holes, self.strays)

    def topic(self, name: str) -> Table:
        """Return a topic; RecordingError if there is none."""
        if name not in self.topics:
            raise RecordingError(
                f"The recording {self.path} has no topic {name!r}. "
                f"It has: {', '.join(self.topics) or 'none at all'}."
                + ("" if self.complete else " It was cut or damaged before one.")
            )
        return self.topics[name]

    def read(self, wanted: Mapping[str, Sequence[str]]) -> None:
        """Read columns of several topics in one pass over the file: those that are there."""
        names = {
            topic: [name for name in columns if name in self.topics[topic].names]
            for topic, columns in wanted.items()
            if topic in self.topics
        }
        found = {topic: Filling(self.topics[topic], columns) for topic, columns in names.items()}
        for block in rows_in_blocks(MessageStream(self.path, self._survey.size), names):
            for topic, (times_ns, rows) in block.items():
                found[topic].add(times_ns, rows)
        for filling in found.values():
            filling.finish()

    def rows(self, topic: str) -> Iterator[tuple[int, Row]]:
        """Stream (flight time in ns, row) of one topic; nothing if the topic is absent."""
        for block in self.blocks((topic,)):
            yield from zip(*block[topic], strict=True)

    def blocks(self, topics: Iterable[str]) -> Iterator[dict[str, tuple[list[int], list[Row]]]]:
        """Stream the flight times in ns and the rows of some topics, block by block in one pass."""
        # All passes end where the first one did, also in a file that still grows.
        size = self._survey.size if "_survey" in vars(self) else None
        return rows_in_blocks(MessageStream(self.path, size), dict.fromkeys(topics))

    @cached_property
    def topics(self) -> dict[str, Table]:
        _ = self._survey
        return self._tables

    @cached_property
    def _survey(self) -> MessageStream:
        """The file read to its end, its rows counted."""
        stream = MessageStream(self.path, self.path.stat().st_size)
        tables: dict[str, Table] = {}
        for block in stream.texts():
            for topic, (times, _) in block.items():
                if topic not in tables:
                    tables[topic] = Table(self, stream.channels[topic])
                tables[topic].count(times)
        self._tables = tables
        return stream


def rows_in_blocks(
    stream: MessageStream, wanted: Mapping[str, Sequence[str] | None]
) -> Iterator[dict[str, tuple[list[int], list[Row]]]]:
    """Yield block by block the times and rows of some topics, in one pass over the file.

    `wanted` gives for each topic the fields that will be used, which alone are checked; None: all.
    """
    decoders: dict[str, RowDecoder] = {}
    for block in stream.texts():
        found = {}
        for topic, (times, texts) in block.items():
            if topic in wanted:
                if topic not in decoders:
                    channel = stream.channels[topic]
                    decoders[topic] = RowDecoder(str(stream.path), channel, wanted[topic])
                found[topic] = (times, decoders[topic].decode(texts))
        if found:
            yield found


def stored_metadata(path: Path, names: Sequence[str]) -> dict[str, dict[str, str]]:
    """Return metadata of a finished recording by way of its index, without reading its rows."""
    found: dict[str, dict[str, str]] = {}
    with open_recording(path) as stream:
        size = os.fstat(stream.fileno()).st_size
        for index in list(summary_of_file(stream, size)):
            if isinstance(index, MetadataIndex) and index.name in names:
                record = metadata_at(stream, index.offset, size)
                if record is not None and record.name == index.name:
                    found[record.name] = dict(record.metadata)
    return found


def open_recording(path: Path) -> BinaryIO:
    """Open a recording for reading. Raises RecordingError for what is missing or no plain file."""
    try:
        return open_plain(path)
    except OSError as error:
        raise RecordingError(
            f"The recording {path} cannot be read: {error.strerror or error}. "
            "Check the path; `runs/` holds one folder per run."
        ) from error


def _check_head(path: Path, head: bytes) -> None:
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
