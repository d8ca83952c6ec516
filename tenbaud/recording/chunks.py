"""The records of an MCAP file in blocks: those of a chunk, or one that stands alone.

The `mcap` package's reader makes an object of every entry in a file's indexes, and a stream of every
message; a flight of ten minutes has 200,000 of each, and a person waits. This one reads what a
recording is made of and steps over the rest. Nothing in the file decides how much memory is asked for:
every length is checked against the file and the bounds below first. After damage the reading goes on at
the next chunk that is whole (`resync.py`).
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from io import BytesIO
from typing import BinaryIO

import lz4.frame
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Footer, Message, Metadata, MetadataIndex, Schema
from mcap.writer import MCAP0_MAGIC

CHUNK_BYTES_MAX = 16 << 20
"""Of a chunk's content. A recorder closes its chunks at 256 KiB, other tools at 4 MiB."""
RECORD_BYTES_MAX = 32 << 20
"""Of a record that is read at all."""
EXPANSION_MAX = 256
"""Content over compressed bytes; rows of a flight reach some 10, of one that stands still some 40."""
EXPANSION_FREE_BYTES = 64 << 10
"""Content of a chunk that may be larger than that: a few rows, all alike."""

RawMessage = tuple[int, int, bytes]
"""(channel id, log time in ns, data): a plain tuple, as there are very many."""

Described = Schema | Channel | Metadata | Footer

HEAD = struct.Struct("<BQ")
FOOTER_BYTES = 20
CHUNK_HEAD = struct.Struct("<QQQII")
"""start and end time, size of the content, its checksum, length of the compression's name"""
_MESSAGE = struct.Struct("<HIQQ")
_INDEX_HEAD = struct.Struct("<HI")
_INDEX_ENTRY_BYTES = 16
_MESSAGE_OPCODE = int(Opcode.MESSAGE)
_READERS = {
    Opcode.SCHEMA: Schema.read,
    Opcode.CHANNEL: Channel.read,
    Opcode.METADATA: Metadata.read,
    Opcode.FOOTER: Footer.read,
}
SKIPPED = (Opcode.HEADER, Opcode.ATTACHMENT, Opcode.DATA_END)
"""Records of a file's data that bring nothing."""
SUMMARY = (
    *(Opcode.STATISTICS, Opcode.CHUNK_INDEX, Opcode.ATTACHMENT_INDEX),
    *(Opcode.METADATA_INDEX, Opcode.SUMMARY_OFFSET),
)
"""Only behind the end of the data; before it they are a sign of damage."""


class Torn(ValueError):
    """The file ends in the middle of something, or what it holds there is not what was written."""


BROKEN = (Torn, McapError, struct.error, zstandard.ZstdError, UnicodeDecodeError)
"""The exceptions of reading a damaged record; they depend on the place of the damage."""


@dataclass(slots=True)
class Block:
    """The contents of one record of the file: messages in order, and their descriptions."""

    messages: list[RawMessage] = field(default_factory=list)
    described: list[Described] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class Damage:
    """Bytes `start` to `end` of a file that could not be read, and why."""

    start: int
    end: int
    reason: str


def summary_of_file(stream: BinaryIO, size: int) -> Iterator[Described | MetadataIndex]:
    """Yield what the end of a finished file repeats: schemas, channels, and where metadata are.

    Nothing, where the file has no end or it is damaged.
    """
    end = size - len(MCAP0_MAGIC) - HEAD.size - FOOTER_BYTES
    try:
        head = read_head(stream, end, size) if end > 0 else None
        if head != (Opcode.FOOTER, FOOTER_BYTES):
            return
        at = Footer.read(_Exact(stream.read(FOOTER_BYTES))).summary_start or end
        while at < end:
            head = read_head(stream, at, end)
            if head is None:
                return
            opcode, length = head
            at += HEAD.size + length
            if opcode in (Opcode.SCHEMA, Opcode.CHANNEL) and length <= RECORD_BYTES_MAX:
                yield _described(opcode, stream.read(length))
            elif opcode == Opcode.METADATA_INDEX and length <= RECORD_BYTES_MAX:
                yield MetadataIndex.read(_Exact(stream.read(length)))
    except BROKEN:
        return


def metadata_at(stream: BinaryIO, at: int, size: int) -> Metadata | None:
    """Return the metadata record at `at`; None if there is none."""
    try:
        head = read_head(stream, at, size)
        if head is None or head[0] != Opcode.METADATA or head[1] > RECORD_BYTES_MAX:
            return None
        record: Metadata = Metadata.read(_Exact(stream.read(head[1])))
        return record
    except (*BROKEN, OverflowError):
        return None


def read_head(stream: BinaryIO, at: int, size: int) -> tuple[int, int] | None:
    """Return opcode and length of the record at `at`; None at the end of the file. Raises Torn."""
    stream.seek(at)
    head = stream.read(HEAD.size)
    # The closing magic is shorter than the head of a record.
    if head == MCAP0_MAGIC:
        return None
    if len(head) < HEAD.size:
        raise Torn("the file has no end")
    opcode, length = HEAD.unpack(head)
    if opcode == 0:
        raise Torn("the file goes on with zeros")
    if length > size - at - HEAD.size:
        raise Torn("a record is longer than the rest of the file")
    return opcode, length


def read_record(
    stream: BinaryIO, opcode: int, length: int, skipped: tuple[Opcode, ...]
) -> tuple[Block | None, bool]:
    """Read one record; return what it brought, and whether its length is beyond doubt."""
    if opcode == Opcode.MESSAGE_INDEX:
        index = stream.read(_INDEX_HEAD.size)
        entries = length - _INDEX_HEAD.size
        confirmed = len(index) == _INDEX_HEAD.size and _INDEX_HEAD.unpack(index)[1] == entries
        if not confirmed or entries % _INDEX_ENTRY_BYTES:
            raise Torn("an index contradicts its length")
        stream.seek(entries, 1)
        return None, True
    if opcode in skipped:
        stream.seek(length, 1)
        return None, False
    if opcode not in (Opcode.CHUNK, Opcode.MESSAGE, *_READERS):
        raise Torn(f"a record is of the unknown kind {opcode}")
    if length > RECORD_BYTES_MAX:
        raise Torn(f"a record has {length} bytes, at most {RECORD_BYTES_MAX} are read")
    content = stream.read(length)
    if opcode == Opcode.CHUNK:
        return block_of_chunk(content), True
    if opcode == Opcode.MESSAGE:
        message = Message.read(_Exact(content), length)
        return Block([(message.channel_id, message.log_time, message.data)]), True
    return Block(described=[_described(opcode, content)]), True


def _described(opcode: int, content: bytes) -> Described:
    exact = _Exact(content)
    record: Described = _READERS[Opcode(opcode)](exact)
    if exact.left:
        raise Torn("a record contradicts its length")
    return record


class _Exact(ReadDataStream):
    """A record's content, of which no more can be read than there is."""

    def __init__(self, content: bytes) -> None:
        super().__init__(BytesIO(content))
        self.left = len(content)

    def read(self, length: int) -> bytes:
        """Return exactly `length` bytes; raises Torn."""
        if length > self.left:
            raise Torn("a record ends within a field")
        self.left -= length
        data: bytes = super().read(length)
        return data


def block_of_chunk(content: bytes) -> Block:
    """Return the records of a chunk. Raises Torn, ZstdError or struct.error where it is damaged."""
    data = _unpacked(content)
    block = Block()
    add, read_head, read_message = block.messages.append, HEAD.unpack_from, _MESSAGE.unpack_from
    head_bytes, message_bytes = HEAD.size, _MESSAGE.size
    at, end = 0, len(data)
    while at < end:
        opcode, length = read_head(data, at)
        at += head_bytes
        after = at + length
        if after > end:
            raise Torn("a record is longer than the rest of its chunk")
        if opcode == _MESSAGE_OPCODE:
            if length < message_bytes:
                raise Torn("a message is shorter than its head")
            channel_id, _, log_time, _ = read_message(data, at)
            add((channel_id, log_time, data[at + message_bytes : after]))
        elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            block.described.append(_described(opcode, data[at:after]))
        at = after
    return block


def _unpacked(content: bytes) -> bytes:
    """Return the content of a chunk record, decompressed and checked."""
    _, _, size, checksum, name_bytes = CHUNK_HEAD.unpack_from(content)
    at = CHUNK_HEAD.size
    if name_bytes > 16:
        raise Torn("a chunk names no compression")
    compression = content[at : at + name_bytes].decode()
    at += name_bytes
    (packed_bytes,) = struct.unpack_from("<Q", content, at)
    packed = memoryview(content)[at + 8 :]
    if len(packed) != packed_bytes:
        raise Torn("a chunk contradicts its length")
    if size > CHUNK_BYTES_MAX:
        raise Torn(f"a chunk would unpack to {size} bytes, at most {CHUNK_BYTES_MAX} are read")
    if size > EXPANSION_FREE_BYTES + EXPANSION_MAX * packed_bytes:
        raise Torn(f"a chunk of {packed_bytes} bytes would unpack to {size}, which no flight does")
    data = _decompressed(compression, packed, size)
    if len(data) != size:
        raise Torn("a chunk unpacks to another size than it says")
    if checksum and zlib.crc32(data) != checksum:
        raise Torn("the checksum of a chunk differs")
    return data


def _decompressed(compression: str, packed: memoryview, size: int) -> bytes:
    match compression:
        case "":
            return bytes(packed)
        case "zstd":
            # A frame that states its size is unpacked to that size whatever limit is given.
            if zstandard.frame_content_size(packed) not in (size, -1):
                raise Torn("a chunk unpacks to another size than it says")
            return zstandard.ZstdDecompressor().decompress(packed, max_output_size=size)
        case "lz4":
            try:
                unpacked: bytes = lz4.frame.LZ4FrameDecompressor().decompress(packed, max_length=size)
                return unpacked
            except RuntimeError as error:
                raise Torn(f"a chunk cannot be unpacked ({error})") from error
        case _:
            raise Torn(f"a chunk is packed with {compression!r}, which is not known here")
