"""Frames as bytes, for every line that keeps message boundaries.

    version u8 | kind u8 | session u32 | epoch u16 | body | CRC-16/CCITT-FALSE u16

All little-endian; the CRC covers everything before it. Frames that belong to no session have zeros
there. Bodies, by kind:

    1 hello     incarnation u32, request u32, sample u32, why u8, config digest 16 bytes,
                probe 8 bytes, version text
    2 welcome   incarnation u32, request u32, first sample u32, inputs u8, steps s16 ...,
                state bytes
    3 refuse    incarnation u32, ending u8, text, config text
    4 symbol    slot u32, number u8
    5 commands  last sample u32, echoes u8, then per echo: word u16, digest u64, steps s16 ...
    6 desync    sample u32, digests u64 u64, state bytes
    7 bye       ending u8, text
    8 unknown   nothing
    9 claim     session that takes over u32
    10 down symbol  slot u32, number u8

A text is a u16 length and that many bytes of UTF-8.

A message whose first two bits are 10 is a command frame of the compact downlink
(`channel.protocol.compact`), without this head. Its CRC covers the four bytes of the session and then
the frame, so that only an end which knows the session can check it.
"""

from __future__ import annotations

import struct
from binascii import crc_hqx
from dataclasses import replace
from functools import cache
from typing import Any, NamedTuple, Protocol

from channel.errors import FrameError
from channel.protocol.endings import Ending
from channel.protocol.frames import (
    Bye,
    Claim,
    Commands,
    Desync,
    DownSymbol,
    Echo,
    ForeignVersion,
    Frame,
    Hello,
    Refuse,
    ShortCommands,
    Symbol,
    Unknown,
    Welcome,
    Why,
)

WIRE_VERSION = 2
FRAME_BYTES_MAX = 16_384
"""No frame of ours comes near it; longer ones are dropped unread."""
CRC_START = 0xFFFF
SHORT_MARK = 0x80
"""The first two bits of a compact command frame; versions stay below it."""

_HEAD = struct.Struct("<BBIH")
_CRC = struct.Struct("<H")
_WELCOME = struct.Struct("<IIIB")
_SYMBOL = struct.Struct("<IB")
_COMMANDS = struct.Struct("<IB")
_ECHO = struct.Struct("<HQ")
_TEXT = struct.Struct("<H")
_SYMBOL_STARTS = (bytes((WIRE_VERSION, 4)), bytes((WIRE_VERSION, 10)))


class _Body(NamedTuple):
    """A body of numbers, then texts, then bytes up to the end."""

    kind: int
    frame: Any
    layout: struct.Struct
    numbers: tuple[str, ...]
    texts: tuple[str, ...] = ()
    rest: str = ""


_HELLO = ("incarnation", "request", "sample", "why", "config_digest", "numerics_probe")
_DESYNC = ("sample", "transmitter_digest", "receiver_digest")
_BODIES = (
    _Body(1, Hello, struct.Struct("<IIIB16s8s"), _HELLO, ("version",)),
    _Body(3, Refuse, struct.Struct("<IB"), ("incarnation", "ending"), ("text", "config")),
    _Body(6, Desync, struct.Struct("<IQQ"), _DESYNC, rest="state"),
    _Body(7, Bye, struct.Struct("<B"), ("ending",), ("text",)),
    _Body(8, Unknown, struct.Struct("<"), ()),
    _Body(9, Claim, struct.Struct("<I"), ("by",)),
    _Body(10, DownSymbol, struct.Struct("<IB"), ("slot", "number")),
)
"""Those of the frames that are not written out below."""
_OF_KIND = {one.kind: one for one in _BODIES}
_OF_FRAME = {one.frame: one for one in _BODIES}


class SymbolWire(Protocol):
    """How a line carries symbols: the paid path of either direction."""

    def is_symbol(self, data: bytes) -> bool:
        """Return whether a message of ours carries a symbol."""

    def renumbered(self, data: bytes, shift: int, kinds: int) -> bytes:
        """Return a symbol's message with the number `shift` further on in an alphabet of `kinds`."""


class Wire(SymbolWire, Protocol):
    """How frames look on one kind of line. A link says which it needs."""

    def encode(self, frame: Frame) -> bytes:
        """Return the message for a frame; ValueError for values that no frame can carry."""

    def decode(self, data: bytes) -> Frame:
        """Return the frame in a message; FrameError, with the reason, for anything else."""

    def size(self, data: bytes) -> int:
        """Return how many bytes a message takes on the line, framing included."""


def foreign_version_text(peer: str, version: int) -> str:
    """Return the advice for a peer whose frames are of another wire version."""
    return (
        f"the {peer} speaks wire version {version}, this end {WIRE_VERSION}: install the same tenbaud "
        "on both"
    )


def encode(frame: Frame) -> bytes:
    """Return the bytes of a frame; ValueError for values that no frame can carry."""
    if isinstance(frame, ShortCommands):
        if frame.data[:1] < b"\x80" or frame.data[:1] >= b"\xc0":
            raise ValueError("compact commands begin with the bits 10")
        return frame.data + _CRC.pack(frame.checksum)
    try:
        kind, body = _encode_body(frame)
        session, epoch = getattr(frame, "session", 0), getattr(frame, "epoch", 0)
        message = _HEAD.pack(WIRE_VERSION, kind, session, epoch) + body
    except struct.error as error:
        raise ValueError(f"{frame} does not fit a frame: {error}") from error
    if len(message) + _CRC.size > FRAME_BYTES_MAX:
        raise ValueError(f"a frame has at most {FRAME_BYTES_MAX} bytes, this one {len(message)}")
    return message + _CRC.pack(crc_hqx(message, CRC_START))


def is_short(data: bytes) -> bool:
    """Return whether a message that is no symbol byte begins as a compact command frame."""
    return len(data) > _CRC.size and data[0] & 0xC0 == SHORT_MARK


def decode(data: bytes) -> Frame:
    """Return the frame in these bytes; FrameError, with the reason, for anything else."""
    size = len(data)
    if size > FRAME_BYTES_MAX:
        raise FrameError(f"oversized: {size} bytes, at most {FRAME_BYTES_MAX}")
    short = is_short(data)
    if size < _HEAD.size + _CRC.size and not short:
        raise FrameError(f"truncated: {size} bytes")
    message, (checksum,) = data[: -_CRC.size], _CRC.unpack(data[-_CRC.size :])
    if short:
        return ShortCommands(message, checksum)
    if checksum != crc_hqx(message, CRC_START):
        raise FrameError("checksum")
    version, kind, session, epoch = _HEAD.unpack_from(message)
    if version != WIRE_VERSION:
        return ForeignVersion(version)
    try:
        return _decode_body(kind, session, epoch, message[_HEAD.size :])
    except (struct.error, UnicodeDecodeError) as error:
        raise FrameError(f"malformed frame of kind {kind}: {error}") from error


def _encode_body(frame: Frame) -> tuple[int, bytes]:
    match frame:
        case Symbol():
            return 4, _SYMBOL.pack(frame.slot, frame.number)
        case Commands():
            return 5, _encode_commands(frame)
        case Welcome():
            return 2, _encode_welcome(frame)
        case Hello() if len(frame.config_digest) != 16 or len(frame.numerics_probe) != 8:
            raise ValueError("a greeting has a digest of 16 bytes and a probe of 8")
    body = _OF_FRAME.get(type(frame))
    if body is None:
        raise ValueError(f"{frame} is only ever received")
    data = body.layout.pack(*[getattr(frame, name) for name in body.numbers])
    data += b"".join([_text(getattr(frame, name)) for name in body.texts])
    return body.kind, data + getattr(frame, body.rest, b"")


def _decode_body(kind: int, session: int, epoch: int, data: bytes) -> Frame:
    match kind:
        case 2:
            return _decode_welcome(session, epoch, data)
        case 4:
            return Symbol(session, epoch, *_SYMBOL.unpack(data))
        case 5:
            return _decode_commands(session, epoch, data)
    body = _OF_KIND.get(kind)
    if body is None:
        raise FrameError(f"unknown kind {kind}")
    values: dict[str, Any] = {"session": session, "epoch": epoch}
    values = {name: values[name] for name in values if name in body.frame.__slots__}
    values |= zip(body.numbers, body.layout.unpack_from(data), strict=True)
    left = data[body.layout.size :]
    for name in body.texts:
        values[name], left = _take_text(left)
    if body.rest:
        values[body.rest], left = left, b""
    if left:
        raise FrameError(f"{len(left)} bytes too many")
    if "ending" in values:
        values["ending"] = Ending(values["ending"])
    if "why" in values:
        try:
            values["why"] = Why(values["why"])
        except ValueError:
            raise FrameError(f"hello for the unknown reason {values['why']}") from None
    frame: Frame = body.frame(**values)
    return frame


def _encode_welcome(frame: Welcome) -> bytes:
    hold = frame.hold_steps
    head = _WELCOME.pack(frame.incarnation, frame.request, frame.first_sample, len(hold))
    return head + struct.pack(f"<{len(hold)}h", *hold) + frame.state


def _decode_welcome(session: int, epoch: int, body: bytes) -> Welcome:
    incarnation, request, first_sample, inputs = _WELCOME.unpack_from(body)
    hold = struct.unpack_from(f"<{inputs}h", body, _WELCOME.size)
    state = body[_WELCOME.size + 2 * inputs :]
    return Welcome(session, epoch, first_sample, incarnation, request, hold, state)


def _encode_commands(frame: Commands) -> bytes:
    if not frame.echoes:
        raise ValueError("a command frame has at least one echo")
    newest = frame.echoes[-1]
    count = len(newest.steps)
    layout = _echo_layout(count)
    parts = [_COMMANDS.pack(newest.sample, len(frame.echoes))]
    sample = newest.sample + 1 - len(frame.echoes)
    for echo in frame.echoes:
        if echo.sample != sample or len(echo.steps) != count:
            raise ValueError("the echoes of a command frame are consecutive and equally long")
        parts.append(layout.pack(echo.word_number, echo.digest, *echo.steps))
        sample += 1
    return b"".join(parts)


@cache
def _echo_layout(count: int) -> struct.Struct:
    return struct.Struct(f"<HQ{count}h")


def _decode_commands(session: int, epoch: int, body: bytes) -> Commands:
    last, count = _COMMANDS.unpack_from(body)
    size, rest = divmod(len(body) - _COMMANDS.size, count) if count else (0, 1)
    values, odd = divmod(size - _ECHO.size, 2)
    if rest or odd or values < 0 or last + 1 < count:
        raise FrameError(f"malformed commands: {count} echoes in {len(body)} bytes")
    echoes = []
    layout = _echo_layout(values)
    for index in range(count):
        word_number, digest, *steps = layout.unpack_from(body, _COMMANDS.size + index * size)
        echoes.append(Echo(last + 1 - count + index, word_number, digest, tuple(steps)))
    return Commands(session, epoch, tuple(echoes))


def _text(text: str) -> bytes:
    data = text.encode()
    return _TEXT.pack(len(data)) + data


def _take_text(data: bytes) -> tuple[str, bytes]:
    (length,) = _TEXT.unpack_from(data)
    end = _TEXT.size + length
    if len(data) < end:
        raise FrameError(f"truncated text: {len(data) - _TEXT.size} of {length} bytes")
    return data[_TEXT.size : end].decode(), data[end:]


class DatagramWire:
    """The frames of this module, one per message: for every line that keeps message boundaries."""

    encode = staticmethod(encode)
    decode = staticmethod(decode)

    def size(self, data: bytes) -> int:
        """Return the length: the frame is all that we put on such a line."""
        return len(data)

    def is_symbol(self, data: bytes) -> bool:
        """Return whether the head of a frame says that it is a symbol."""
        return data.startswith(_SYMBOL_STARTS)

    def renumbered(self, data: bytes, shift: int, kinds: int) -> bytes:
        """Return a symbol's frame with another number, its checksum right again."""
        frame = decode(data)
        if not isinstance(frame, (Symbol, DownSymbol)):
            raise ValueError(f"{frame} is no symbol")
        return encode(replace(frame, number=(frame.number + shift) % kinds))


DATAGRAM = DatagramWire()
