"""The records of an MCAP file, those in its chunks included.

The `mcap` package's reader makes an object of every entry in a file's indexes, and a stream of every
message; a flight of ten minutes has 200,000 of each, and a person waits. This one reads what a
recording is made of and steps over the rest.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from io import BytesIO
from typing import BinaryIO

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, Footer, Message, Metadata, Schema
from mcap.stream_reader import breakup_chunk
from mcap.writer import MCAP0_MAGIC

RawMessage = tuple[int, int, bytes]
"""(channel id, log time in ns, data): a plain tuple, as there are so many."""

Record = RawMessage | Schema | Channel | Metadata | Footer

_HEAD = struct.Struct("<BQ")
_MESSAGE = struct.Struct("<HIQQ")
_HEAD_SIZE, _MESSAGE_SIZE = _HEAD.size, _MESSAGE.size
_MESSAGE_OPCODE = int(Opcode.MESSAGE)


class Torn(ValueError):
    """The file ends in the middle of something, or what it holds there is not what was written."""


def records_of_file(stream: BinaryIO, size: int) -> Iterator[Record]:
    """Yield the records of a file of `size` bytes, in order.

    Raises Torn, or what the decompressor and `struct` raise, where the file was cut or is damaged.
    """
    stream.seek(len(MCAP0_MAGIC))
    while True:
        head = stream.read(_HEAD_SIZE)
        if len(head) < _HEAD_SIZE:
            # The closing magic is shorter than the head of a record.
            if head == MCAP0_MAGIC:
                return
            raise Torn("the file has no end")
        opcode, length = _HEAD.unpack(head)
        if length > size - stream.tell():
            raise Torn("a record is longer than the rest of the file")
        match opcode:
            case Opcode.CHUNK:
                yield from _records_of_chunk(Chunk.read(_content(stream, length)))
            case Opcode.MESSAGE:
                message = Message.read(_content(stream, length), length)
                yield message.channel_id, message.log_time, message.data
            case Opcode.SCHEMA:
                yield Schema.read(_content(stream, length))
            case Opcode.CHANNEL:
                yield Channel.read(_content(stream, length))
            case Opcode.METADATA:
                yield Metadata.read(_content(stream, length))
            case Opcode.FOOTER:
                yield Footer.read(_content(stream, length))
            case 0:
                raise Torn("the file goes on with zeros")
            case _:
                stream.seek(length, 1)


def _content(stream: BinaryIO, length: int) -> ReadDataStream:
    return ReadDataStream(BytesIO(stream.read(length)))


def _records_of_chunk(chunk: Chunk) -> list[Record]:
    """Return schemas, channels and messages of a chunk, in order."""
    if chunk.compression == "zstd":
        data = zstandard.decompress(chunk.data, chunk.uncompressed_size)
    elif chunk.compression == "":
        data = chunk.data
    else:
        return _records_of_other(chunk)
    if chunk.uncompressed_crc and zlib.crc32(data) != chunk.uncompressed_crc:
        raise Torn("the checksum of a chunk differs")
    records: list[Record] = []
    add, read_head, read_message = records.append, _HEAD.unpack_from, _MESSAGE.unpack_from
    at, end = 0, len(data)
    while at < end:
        opcode, length = read_head(data, at)
        at += _HEAD_SIZE
        after = at + length
        if opcode == _MESSAGE_OPCODE:
            channel_id, _, log_time, _ = read_message(data, at)
            add((channel_id, log_time, data[at + _MESSAGE_SIZE : after]))
        elif opcode == Opcode.SCHEMA:
            add(Schema.read(ReadDataStream(BytesIO(data[at:after]))))
        elif opcode == Opcode.CHANNEL:
            add(Channel.read(ReadDataStream(BytesIO(data[at:after]))))
        at = after
    return records


def _records_of_other(chunk: Chunk) -> list[Record]:
    """Read a chunk that another program has packed in another way."""
    records: list[Record] = []
    for record in breakup_chunk(chunk, validate_crc=True):
        if isinstance(record, Message):
            records.append((record.channel_id, record.log_time, record.data))
        elif isinstance(record, Schema | Channel):
            records.append(record)
    return records
