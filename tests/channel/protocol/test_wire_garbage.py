"""Bytes that are no frames: decoding returns a frame or raises FrameError, and nothing else ever."""

from __future__ import annotations

import random
from binascii import crc_hqx

import pytest

from channel.errors import FrameError
from channel.line.line import Inlet
from channel.protocol import wire
from channel.protocol.frames import Frame
from tests.golden.regenerate import example_frames

SEED = 20240615
EXAMPLES = [wire.encode(frame) for frame in example_frames()]


def sealed(message: bytes) -> bytes:
    """Return the message with the checksum that it deserves."""
    return message + crc_hqx(message, wire.CRC_START).to_bytes(2, "little")


def outcome(data: bytes) -> Frame | None:
    try:
        return Inlet().take(data)
    except Exception as error:
        raise AssertionError(f"seed {SEED}: {data.hex()} raises {error!r}") from error


def test_when_bytes_are_random_then_nothing_comes_of_them() -> None:
    chooser = random.Random(SEED)
    accepted = sum(
        outcome(chooser.randbytes(chooser.randrange(0, 80))) is not None for _ in range(5000)
    )
    assert accepted <= 3  # one in 65536 has the right checksum by chance


def test_when_a_frame_is_truncated_then_it_is_refused() -> None:
    for data in EXAMPLES:
        for length in range(len(data)):
            assert outcome(data[:length]) is None
        assert outcome(data + b"\0") is None


def test_when_one_or_two_bits_flip_then_the_checksum_notices() -> None:
    chooser = random.Random(SEED)
    for data in EXAMPLES:
        for bit in range(8 * len(data)):
            flipped = bytearray(data)
            flipped[bit // 8] ^= 1 << bit % 8
            assert outcome(bytes(flipped)) is None
            other = chooser.randrange(8 * len(data))
            if other != bit:
                flipped[other // 8] ^= 1 << other % 8
                assert outcome(bytes(flipped)) is None


def mutated(message: bytes, chooser: random.Random) -> bytes:
    """Return the message with bits flipped, bytes cut, put in or overwritten, or lengths that lie."""
    changed = bytearray(message)
    for _ in range(chooser.randrange(1, 4)):
        kind = chooser.randrange(6)
        place = chooser.randrange(len(changed)) if changed else 0
        if kind == 0 and changed:
            changed[place] ^= 1 << chooser.randrange(8)
        elif kind == 1:
            del changed[place:]
        elif kind == 2:
            changed[place:place] = chooser.randbytes(chooser.randrange(1, 20))
        elif kind == 3 and changed:
            changed[place] = chooser.choice((0, 1, 0x7F, 0x80, 0xFF))
        elif kind == 4:
            changed[place : place + 2] = chooser.choice((b"\xff\xff", b"\0\0", b"\1\0", b"\x80\x80"))
        else:
            del changed[place : place + chooser.randrange(1, 9)]
    if len(changed) > 1 and chooser.random() < 0.7:
        changed[0] = wire.WIRE_VERSION
        if chooser.random() < 0.3:
            changed[1] = chooser.randrange(0, 9)
    return bytes(changed)


def test_when_lies_carry_a_right_checksum_then_the_inner_readers_refuse_them_cleanly() -> None:
    chooser = random.Random(SEED)
    accepted = refused = 0
    for _ in range(20_000):
        data = sealed(mutated(chooser.choice(EXAMPLES)[:-2], chooser))
        frame = outcome(data)
        if frame is None:
            refused += 1
        else:
            accepted += 1
    assert accepted > 1000
    assert refused > 1000


def test_when_random_bodies_carry_a_right_checksum_then_they_are_frames_or_refused() -> None:
    chooser = random.Random(SEED)
    kinds = set()
    for _ in range(20_000):
        head = bytes((wire.WIRE_VERSION, chooser.randrange(0, 10))) + chooser.randbytes(6)
        frame = outcome(sealed(head + chooser.randbytes(chooser.randrange(0, 60))))
        kinds.add(type(frame).__name__)
    assert {"Symbol", "Welcome", "Desync"} <= kinds


def test_when_a_decoded_frame_is_encoded_then_it_is_decoded_to_the_same() -> None:
    chooser = random.Random(SEED + 1)
    compared = 0
    for _ in range(5000):
        frame = outcome(sealed(mutated(chooser.choice(EXAMPLES)[:-2], chooser)))
        if frame is not None and type(frame).__name__ != "ForeignVersion":
            assert wire.decode(wire.encode(frame)) == frame
            compared += 1
    assert compared > 200


@pytest.mark.parametrize("extra", [1, 1000, 1_000_000])
def test_when_bytes_are_too_many_then_they_are_not_even_read(extra: int) -> None:
    with pytest.raises(FrameError, match="oversized"):
        wire.decode(sealed(bytes(wire.FRAME_BYTES_MAX + extra - 2)))


@pytest.mark.parametrize("kind", [0, 11, 255])
def test_when_the_kind_is_unknown_then_it_is_named(kind: int) -> None:
    with pytest.raises(FrameError, match=f"unknown kind {kind}"):
        wire.decode(sealed(bytes((wire.WIRE_VERSION, kind)) + bytes(6)))


@pytest.mark.parametrize(
    ("kind", "body", "text"),
    [
        (7, b"\x01\x0a\x00abc", "truncated text: 3 of 10 bytes"),
        (7, b"\x01\x02\x00abc", "1 bytes too many"),
        (1, bytes(37) + b"\x05\x00ab", "truncated text"),
        (3, bytes(5) + b"\x01\x00a" + b"\xff\xff", "truncated text"),
        (3, bytes(5) + b"\x01\x00a" + b"\x00\x00" + b"x", "1 bytes too many"),
        (5, bytes(5), "malformed commands: 0 echoes"),
        (5, bytes(4) + b"\x02" + bytes(20), "malformed commands: 2 echoes"),  # sample -1
        (5, bytes(4) + b"\x01" + bytes(11), "malformed commands"),  # half a voltage
        (5, bytes(4) + b"\x01" + bytes(9), "malformed commands"),  # half an echo
        (5, b"\xff" * 4 + b"\x03" + bytes(31), "malformed commands"),  # unequal echoes
        (4, bytes(4), "malformed frame of kind 4"),
        (4, bytes(6), "malformed frame of kind 4"),
        (7, b"\x01\x01\x00\xff", "malformed frame of kind 7"),
    ],
)
def test_when_a_length_lies_then_the_refusal_says_how(kind: int, body: bytes, text: str) -> None:
    with pytest.raises(FrameError) as caught:
        wire.decode(sealed(bytes((wire.WIRE_VERSION, kind)) + bytes(6) + body))
    assert text in str(caught.value)
