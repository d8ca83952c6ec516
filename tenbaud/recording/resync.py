"""Reads a recording from beginning to end, and resynchronises after damaged parts."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import BinaryIO

from mcap.opcode import Opcode
from mcap.writer import MCAP0_MAGIC

from tenbaud.recording.chunks import (
    BROKEN,
    HEAD,
    RECORD_BYTES_MAX,
    SKIPPED,
    SUMMARY,
    Block,
    Damage,
    block_of_chunk,
    read_head,
    read_record,
)

WINDOW_BYTES = 1 << 20
MISSES_MAX = 200
"""Bytes that look like a chunk and are none; by accident there are none of these in a recording."""

# Opcode, a length below 2^32, 28 bytes of times, size and checksum, and the name of a compression.
_CHUNK = re.compile(rb"\x06.{4}\0{4}.{28}(?:\0{4}|\x03\0{3}lz4|\x04\0{3}zstd)", re.DOTALL)
_CHUNK_BYTES = 64
_OPCODES = range(Opcode.HEADER, Opcode.DATA_END + 1)


class Resync:
    """Finds the next valid record, in one file and within a limited effort."""

    def __init__(self, stream: BinaryIO, size: int) -> None:
        self._stream = stream
        self._size = size
        self._misses = 0

    def after(self, bad: int, certain: int) -> int:
        """Return where to go on after the damaged record at `bad`; the file's size: nowhere.

        Between `certain` and `bad` are records whose lengths nothing confirmed, so that the damage may
        lie in one of those.
        """
        if certain == bad:
            behind = self._behind(bad)
            if behind is not None:
                return behind
        return self._next_chunk(certain + 1)

    def _behind(self, bad: int) -> int | None:
        """Return the end of the damaged record, if its length leads to the head of another one."""
        try:
            head = read_head(self._stream, bad, self._size)
            if head is None or head[0] not in _OPCODES:
                return None
            behind = bad + HEAD.size + head[1]
            following = read_head(self._stream, behind, self._size)
        except BROKEN:
            return None
        return behind if following is None or following[0] in _OPCODES else None

    def _next_chunk(self, start: int) -> int:
        while start < self._size and self._misses < MISSES_MAX:
            self._stream.seek(start)
            window = self._stream.read(WINDOW_BYTES + _CHUNK_BYTES)
            match = _CHUNK.search(window)
            while match is not None and self._misses < MISSES_MAX:
                if self._is_chunk(start + match.start()):
                    return start + match.start()
                match = _CHUNK.search(window, match.start() + 1)
            start += WINDOW_BYTES
        return self._size

    def _is_chunk(self, at: int) -> bool:
        try:
            head = read_head(self._stream, at, self._size)
            if head is None or head[1] > RECORD_BYTES_MAX:
                return False
            block_of_chunk(self._stream.read(head[1]))
        except BROKEN:
            self._misses += 1
            return False
        return True


def blocks_of_file(stream: BinaryIO, size: int) -> Iterator[Block | Damage]:
    """Yield the blocks of a file of `size` bytes; after damage from the next whole chunk on."""
    resync = Resync(stream, size)
    at = len(MCAP0_MAGIC)
    # Up to here every length was confirmed by a checksum or by a second length.
    certain = at
    kinds: tuple[Opcode, ...] = SKIPPED
    while at < size:
        try:
            head = read_head(stream, at, size)
            if head is None:
                return
            kinds = kinds + SUMMARY if head[0] == Opcode.DATA_END else kinds
            block, confirmed = read_record(stream, *head, kinds)
        except BROKEN as error:
            found = resync.after(at, certain)
            yield Damage(at, found, str(error) or "a record is corrupt")
            at = certain = found
            continue
        if block is not None:
            yield block
        at = stream.tell()
        certain = at if confirmed else certain
    yield Damage(size, size, "the file has no end")
