"""Writes an MCAP file in chunks, the counterpart of `chunks`.

The `mcap` package's writer makes an object of every message and a dozen calls to pack it, which is
most of the time that a recorded row costs. Here a message is packed in one go and its index entry kept
as two integers; every other record is the package's.
"""

from __future__ import annotations

import struct
import zlib
from typing import IO

import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)
from mcap.writer import MCAP0_MAGIC

_MESSAGE = struct.Struct("<BQHIQQ")
_MESSAGE_HEAD_BYTES = 22
"""of channel, sequence and two times: what a message's length counts beside its data"""
_MESSAGE_OPCODE = int(Opcode.MESSAGE)
_INDEX_HEAD = struct.Struct("<BQHI")
_FOOTER_CRC = struct.Struct("<BQQQ")


class ChunkWriter:
    """Writes schemas, channels and messages into compressed, indexed chunks of a stream.

    What is handed in reaches the stream when a chunk is full, with `flush`, or with `finish`.
    """

    def __init__(self, stream: IO[bytes], chunk_bytes: int) -> None:
        self._stream = stream
        self._chunk_bytes = chunk_bytes
        self._chunk = bytearray()
        self._entries: dict[int, list[int]] = {}
        """of the messages in the open chunk, by channel: time, offset, time, offset, ..."""
        self._schemas: list[Schema] = []
        self._channels: list[Channel] = []
        self._chunks: list[ChunkIndex] = []
        self._metadata: list[MetadataIndex] = []
        self._messages: dict[int, int] = {}

    def start(self, profile: str, library: str) -> None:
        self._stream.write(MCAP0_MAGIC + _bytes_of(Header(profile, library)))

    def add_metadata(self, name: str, metadata: dict[str, str]) -> None:
        """Write a metadata record, before what the open chunk holds."""
        data = _bytes_of(Metadata(name=name, metadata=metadata))
        self._metadata.append(MetadataIndex(offset=self._stream.tell(), length=len(data), name=name))
        self._stream.write(data)

    def register(self, topic: str, schema: bytes) -> int:
        """Add a channel of JSON messages; return its number, which they are added under."""
        number = len(self._channels) + 1
        described = Schema(id=number, data=schema, encoding="jsonschema", name=topic)
        channel = Channel(
            id=number, topic=topic, message_encoding="json", metadata={}, schema_id=number
        )
        self._schemas.append(described)
        self._channels.append(channel)
        self._chunk += _bytes_of(described) + _bytes_of(channel)
        return number

    def add_message(self, channel_id: int, time_ns: int, data: bytes) -> None:
        chunk = self._chunk
        entries = self._entries.get(channel_id)
        if entries is None:
            entries = self._entries[channel_id] = []
        length = _MESSAGE_HEAD_BYTES + len(data)
        head = _MESSAGE.pack(_MESSAGE_OPCODE, length, channel_id, 0, time_ns, time_ns)
        entries += (time_ns, len(chunk))
        chunk += head
        chunk += data
        if len(chunk) > self._chunk_bytes:
            self._end_chunk()

    def flush(self) -> None:
        """End the open chunk, and hand everything to the operating system."""
        self._end_chunk()
        self._stream.flush()

    def finish(self) -> None:
        """Write the summary and the end of the file; the stream stays open."""
        self._end_chunk()
        self._stream.write(_bytes_of(DataEnd(0)))
        summary_start = self._stream.tell()
        summary = b""
        offsets = b""
        groups: tuple[tuple[Opcode, list[McapRecord]], ...] = (
            (Opcode.SCHEMA, [*self._schemas]),
            (Opcode.CHANNEL, [*self._channels]),
            (Opcode.STATISTICS, [self._statistics()]),
            (Opcode.CHUNK_INDEX, [*self._chunks]),
            (Opcode.METADATA_INDEX, [*self._metadata]),
        )
        for opcode, records in groups:
            data = b"".join(map(_bytes_of, records))
            if not data:
                continue
            start = summary_start + len(summary)
            offsets += _bytes_of(SummaryOffset(opcode, group_length=len(data), group_start=start))
            summary += data
        offset_start = summary_start + len(summary)
        summary += offsets
        head = _FOOTER_CRC.pack(Opcode.FOOTER, 20, summary_start, offset_start)
        crc = zlib.crc32(head, zlib.crc32(summary))
        footer = Footer(summary_start=summary_start, summary_offset_start=offset_start, summary_crc=crc)
        self._stream.write(summary + _bytes_of(footer) + MCAP0_MAGIC)

    def _end_chunk(self) -> None:
        """Write the open chunk and the indexes of its messages, if it has any."""
        if not self._entries:
            return
        data = bytes(self._chunk)
        packed = zstandard.compress(data)
        times = [time for entries in self._entries.values() for time in entries[::2]]
        chunk = Chunk(
            compression="zstd",
            data=packed,
            message_start_time=min(times),
            message_end_time=max(times),
            uncompressed_crc=zlib.crc32(data),
            uncompressed_size=len(data),
        )
        record = _bytes_of(chunk)
        chunk_start = self._stream.tell()
        at = index_start = chunk_start + len(record)
        places = {}
        indexes = []
        for channel_id, entries in self._entries.items():
            self._messages[channel_id] = self._messages.get(channel_id, 0) + len(entries) // 2
            places[channel_id] = at
            indexes.append(_message_index(channel_id, entries))
            at += len(indexes[-1])
        self._stream.write(record + b"".join(indexes))
        self._chunks.append(
            ChunkIndex(
                chunk_length=len(record),
                chunk_start_offset=chunk_start,
                compression=chunk.compression,
                compressed_size=len(packed),
                message_end_time=chunk.message_end_time,
                message_index_length=at - index_start,
                message_index_offsets=places,
                message_start_time=chunk.message_start_time,
                uncompressed_size=len(data),
            )
        )
        self._chunk = bytearray()
        self._entries = {}

    def _statistics(self) -> Statistics:
        chunks = self._chunks
        return Statistics(
            attachment_count=0,
            channel_count=len(self._channels),
            channel_message_counts=self._messages,
            chunk_count=len(chunks),
            message_count=sum(self._messages.values()),
            message_end_time=max((chunk.message_end_time for chunk in chunks), default=0),
            message_start_time=min((chunk.message_start_time for chunk in chunks), default=0),
            metadata_count=len(self._metadata),
            schema_count=len(self._schemas),
        )


def _bytes_of(record: McapRecord) -> bytes:
    builder = RecordBuilder()
    record.write(builder)
    return bytes(builder.end())


def _message_index(channel_id: int, entries: list[int]) -> bytes:
    size = 8 * len(entries)
    head = _INDEX_HEAD.pack(Opcode.MESSAGE_INDEX, 6 + size, channel_id, size)
    return head + struct.pack(f"<{len(entries)}Q", *entries)
