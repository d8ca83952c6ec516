"""Reads a recording from its beginning to its end, past what is damaged."""

from __future__ import annotations

from collections.abc import Iterator
from typing import BinaryIO

from mcap.opcode import Opcode
from mcap.writer import MCAP0_MAGIC

from tenbaud.recording.chunks import (
    BROKEN,
    SKIPPED,
    SUMMARY,
    Block,
    Damage,
    read_head,
    read_record,
)
from tenbaud.recording.resync import Resync


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
            yield Damage(at, found, str(error) or "a record is not what was written")
            at = certain = found
            continue
        if block is not None:
            yield block
        at = stream.tell()
        certain = at if confirmed else certain
    yield Damage(size, size, "the file has no end")
