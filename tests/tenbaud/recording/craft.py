"""MCAP files laid record by record, also such as no writer makes."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterable, Sequence

import lz4.frame
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.records import Channel, DataEnd, Footer, Header, Metadata, Schema
from mcap.writer import MCAP0_MAGIC

Message = tuple[int, int, bytes]
"""(channel id, log time in ns, data)"""
Described = tuple[int, str, bytes]
"""(id of schema and channel, topic, schema)"""


def record(opcode: int, content: bytes) -> bytes:
    """Return a record as it stands in a file."""
    return struct.pack("<BQ", opcode, len(content)) + content


def messages_of(messages: Iterable[Message]) -> bytes:
    """Return message records one after the other."""
    parts = []
    for channel, time_ns, data in messages:
        head = struct.pack("<BQHIQQ", 5, 22 + len(data), channel, 0, time_ns, time_ns)
        parts.append(head + data)
    return b"".join(parts)


def chunk(
    content: bytes,
    compression: str = "zstd",
    *,
    packed: bytes | None = None,
    size: int | None = None,
    checksum: int | None = None,
) -> bytes:
    """Return a chunk record; what is given replaces what would be right."""
    if packed is None:
        packing = {"zstd": zstandard.compress, "lz4": lz4.frame.compress, "": bytes}
        packed = packing[compression](content)
    size = len(content) if size is None else size
    checksum = zlib.crc32(content) if checksum is None else checksum
    name = compression.encode()
    head = struct.pack("<QQQII", 0, 0, size, checksum, len(name)) + name
    return record(6, head + struct.pack("<Q", len(packed)) + packed)


def mcap_file(
    body: Sequence[bytes],
    described: Sequence[Described] = (),
    before: Sequence[tuple[str, dict[str, str]]] = (),
    after: Sequence[tuple[str, dict[str, str]]] = (),
) -> bytes:
    """Return a whole file: metadata, descriptions, the given records, metadata, end."""
    head, tail = RecordBuilder(), RecordBuilder()
    Header("tenbaud", "tenbaud").write(head)
    for name, values in before:
        Metadata(name, values).write(head)
    for number, topic, schema in described:
        Schema(number, schema, "jsonschema", topic).write(head)
        Channel(number, topic, "json", {}, number).write(head)
    for name, values in after:
        Metadata(name, values).write(tail)
    DataEnd(0).write(tail)
    Footer(0, 0, 0).write(tail)
    return MCAP0_MAGIC + head.end() + b"".join(body) + tail.end() + MCAP0_MAGIC
