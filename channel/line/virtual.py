"""The virtual clock between two processes.

Virtual time belongs to the transmitter's process. It holds every message of both directions back
until its virtual arrival, so the receiver only ever does one thing: it is given a *step* (a time, and
the message that arrives then, or none because one was lost or a deadline is due) and answers with a
*reply* (its frames, and its next deadline). One step, one reply: nothing can deadlock, and the
flight is as fast as the messages go.

    step   MAGIC u8 | 1 u8 | number u32 | time s64 | message bytes, if any
    reply  MAGIC u8 | 2 u8 | number u32 | next deadline s64 (-1: none) | per frame: u16 length, bytes

A down symbol waits for its slot: its length has the highest bit set, and the time at which it leaves,
an s64, stands before its bytes.

These envelopes exist on the virtual clock only and are not counted as wire bytes.
"""

from __future__ import annotations

import struct
from typing import NamedTuple, Protocol

from channel.errors import FrameError
from channel.line.slots import Departure

MAGIC = 0xF5
"""No wire version will ever be this, so an end on the wrong clock notices. A single byte on a serial
line can be: no envelope is that short."""

_STEP = struct.Struct("<BBIq")
_LENGTH = struct.Struct("<H")
_LATER = 0x8000
"""The bit of a length before a time; no frame is so long."""
_TIME = struct.Struct("<q")


class Step(NamedTuple):
    """Time has passed to `time_ns`, and this message arrives."""

    number: int
    time_ns: int
    data: bytes | None


class Reply(NamedTuple):
    """The receiver's answer to a step."""

    number: int
    deadline_ns: int | None
    frames: tuple[bytes, ...]
    """those that leave at once"""
    later: tuple[Departure, ...] = ()
    """symbols, each in its slot"""


class Peer(Protocol):
    """The receiver as the virtual flight sees it: in this process or in another."""

    def step(self, time_ns: int, data: bytes | None) -> Reply:
        """Let virtual time pass to `time_ns` at the receiver and deliver `data`; LinkLost if silent."""


def is_envelope(data: bytes) -> bool:
    """Return whether these bytes belong to the virtual clock."""
    return len(data) >= _STEP.size and data[0] == MAGIC


def encode_step(step: Step) -> bytes:
    """Return the bytes of a step; a step without a message is the bare head."""
    return _STEP.pack(MAGIC, 1, step.number, step.time_ns) + (step.data or b"")


def decode_step(data: bytes) -> Step:
    """Return the step in these bytes, or raise FrameError."""
    number, time_ns = _decode_head(data, 1)
    return Step(number, time_ns, data[_STEP.size :] or None)


def encode_reply(reply: Reply) -> bytes:
    """Return the bytes of a reply."""
    deadline = -1 if reply.deadline_ns is None else reply.deadline_ns
    parts = [_STEP.pack(MAGIC, 2, reply.number, deadline)]
    for frame in reply.frames:
        parts += (_LENGTH.pack(len(frame)), frame)
    for leaves_ns, symbol in reply.later:
        parts += (_LENGTH.pack(_LATER | len(symbol)), _TIME.pack(leaves_ns), symbol)
    return b"".join(parts)


def decode_reply(data: bytes) -> Reply:
    """Return the reply in these bytes, or raise FrameError."""
    number, deadline = _decode_head(data, 2)
    frames, later = [], []
    left = data[_STEP.size :]
    while left:
        head, left = _take(left, _LENGTH.size)
        (length,) = _LENGTH.unpack(head)
        if length & _LATER:
            time, left = _take(left, _TIME.size)
            symbol, left = _take(left, length ^ _LATER)
            later.append(Departure(_TIME.unpack(time)[0], symbol))
        else:
            frame, left = _take(left, length)
            frames.append(frame)
    return Reply(number, None if deadline < 0 else deadline, tuple(frames), tuple(later))


def _take(data: bytes, count: int) -> tuple[bytes, bytes]:
    """Return the first bytes and those after them."""
    if len(data) < count:
        raise FrameError("truncated reply of the virtual clock")
    return data[:count], data[count:]


def _decode_head(data: bytes, kind: int) -> tuple[int, int]:
    if len(data) < _STEP.size or data[0] != MAGIC or data[1] != kind:
        raise FrameError("not an envelope of the virtual clock")
    _, _, number, time_ns = _STEP.unpack_from(data)
    return number, time_ns
