"""The records in one chunk of an MCAP file.

The `mcap` package reads them as well, but makes a stream and four calls for each; a flight of ten
minutes has 200,000 of them, and a person waits.
"""

from __future__ import annotations

import struct
import zlib
from io import BytesIO

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, Message, Schema
from mcap.stream_reader import breakup_chunk

RawMessage = tuple[int, int, bytes]
"""(channel id, log time in ns, data): a plain tuple, as there are so many."""

_RECORD = struct.Struct("<BQ")
_MESSAGE = struct.Struct("<HIQQ")
_RECORD_SIZE, _MESSAGE_SIZE = _RECORD.size, _MESSAGE.size
_MESSAGE_OPCODE = int(Opcode.MESSAGE)


def records_of(chunk: Chunk) -> list[RawMessage | Schema | Channel]:
    """Return schemas, channels and messages of a chunk, in order.

    Raises what a torn chunk raises: ValueError, struct.error or the decompressor's error.
    """
    if chunk.compression == "zstd":
        data = zstandard.decompress(chunk.data, chunk.uncompressed_size)
    elif chunk.compression == "":
        data = chunk.data
    else:
        return _records_of_other(chunk)
    if chunk.uncompressed_crc and zlib.crc32(data) != chunk.uncompressed_crc:
        raise ValueError("the checksum of a chunk differs")
    records: list[RawMessage | Schema | Channel] = []
    add, head, message_head = records.append, _RECORD.unpack_from, _MESSAGE.unpack_from
    at, end = 0, len(data)
    while at < end:
        opcode, length = head(data, at)
        at += _RECORD_SIZE
        after = at + length
        if opcode == _MESSAGE_OPCODE:
            channel_id, _, log_time, _ = message_head(data, at)
            add((channel_id, log_time, data[at + _MESSAGE_SIZE : after]))
        elif opcode == Opcode.SCHEMA:
            add(Schema.read(ReadDataStream(BytesIO(data[at:after]))))
        elif opcode == Opcode.CHANNEL:
            add(Channel.read(ReadDataStream(BytesIO(data[at:after]))))
        at = after
    return records


def _records_of_other(chunk: Chunk) -> list[RawMessage | Schema | Channel]:
    """Read a chunk that another program has packed in another way."""
    records: list[RawMessage | Schema | Channel] = []
    for record in breakup_chunk(chunk, validate_crc=True):
        if isinstance(record, Message):
            records.append((record.channel_id, record.log_time, record.data))
        elif isinstance(record, Schema | Channel):
            records.append(record)
    return records
