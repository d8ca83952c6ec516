"""A symbol in one byte: every byte value, every check bit; and frames between zeros."""

from __future__ import annotations

from itertools import combinations

import pytest

from channel.errors import FrameError
from channel.links.serial.wire import SerialWire, stuff, stuff_notice, unstuff
from channel.protocol.endings import Ending
from channel.protocol.frames import Bye, DownSymbol, ForeignVersion, ShortSymbol, Symbol
from channel.protocol.wire import DATAGRAM, encode
from tests.golden.regenerate import example_frames

# check << 4 | slot << 1 | number, worked out by hand from x^3 + x + 1 and the xor of 101.
BYTES_OF_TWO = {
    (0, 0): 0b1_101_000_0,
    (0, 1): 0b1_110_000_1,
    (1, 0): 0b1_011_001_0,
    (1, 1): 0b1_000_001_1,
    (2, 0): 0b1_010_010_0,
    (2, 1): 0b1_001_010_1,
    (4, 0): 0b1_000_100_0,
    (7, 1): 0b1_010_111_1,
}
SIZES = {2: 8, 3: 8, 4: 8, 5: 4, 8: 4}
"""Alphabet size and slot modulus."""


def byte_of(wire: SerialWire, slot: int, number: int) -> int:
    (byte,) = wire.encode(Symbol(123456, 3, slot, number))
    return byte


def test_when_a_symbol_is_encoded_then_it_is_the_byte_worked_out_by_hand() -> None:
    wire = SerialWire(2)
    assert {place: byte_of(wire, *place) for place in BYTES_OF_TWO} == BYTES_OF_TWO


@pytest.mark.parametrize(("size", "modulus"), SIZES.items())
def test_when_all_byte_values_are_decoded_then_only_the_symbols_are_symbols(
    size: int, modulus: int
) -> None:
    wire = SerialWire(size)
    assert wire.slot_modulus == modulus
    found = {}
    for byte in range(256):
        data = bytes((byte,))
        if not wire.is_symbol(data):
            assert wire.symbol(byte) is None
            with pytest.raises(FrameError, match=f"0x{byte:02x}"):
                wire.decode(data)
            continue
        frame = wire.decode(data)
        assert isinstance(frame, ShortSymbol)
        found[byte] = frame
    assert len(found) == size * modulus
    assert set(found.values()) == {
        ShortSymbol(number, slot, modulus) for number in range(size) for slot in range(modulus)
    }
    assert min(found) > 0x80  # bit 7 always, and never the byte with nothing else
    assert 0xFF not in found
    for slot in range(40):
        for number in range(size):
            assert found[byte_of(wire, slot, number)] == ShortSymbol(number, slot % modulus, modulus)
        for bit in (0, 1):
            assert wire.encode(DownSymbol(9, 9, slot, bit)) == wire.encode(Symbol(1, 0, slot, bit))


@pytest.mark.parametrize(("size", "bits"), [(2, 2), (4, 1), (8, 1)])
def test_when_that_many_bits_flip_then_the_byte_is_no_symbol(size: int, bits: int) -> None:
    wire = SerialWire(size)
    for slot in range(wire.slot_modulus):
        for number in range(size):
            byte = byte_of(wire, slot, number)
            for count in range(1, bits + 1):
                for places in combinations(range(8), count):
                    mask = sum(1 << place for place in places)
                    assert wire.symbol(byte ^ mask) is None, f"{byte:08b} ^ {mask:08b}"


@pytest.mark.parametrize("size", [0, 1, 9, 256])
def test_when_an_alphabet_does_not_fit_then_it_is_refused(size: int) -> None:
    with pytest.raises(ValueError, match="2 to 8 symbols"):
        SerialWire(size)


def test_when_a_symbol_is_not_of_the_alphabet_then_it_is_refused() -> None:
    with pytest.raises(ValueError, match="symbol 2 is not one of 2"):
        SerialWire(2).encode(Symbol(1, 0, 0, 2))


def test_when_a_frame_is_no_symbol_then_it_is_the_datagram_frame_and_ends_in_its_own_crc() -> None:
    wire = SerialWire(2)
    for frame in example_frames():
        if isinstance(frame, Symbol | DownSymbol | ForeignVersion):
            continue
        data = wire.encode(frame)
        assert data == DATAGRAM.encode(frame)
        assert wire.decode(data) == frame
        line = stuff(data)
        assert line[:1] == line[-1:] == b"\0"
        assert 0 not in line[1:-1]
        assert wire.size(data) == len(line) <= len(data) + 4
        assert unstuff(line[1:-1]) == (False, data)


def test_when_a_symbol_is_sized_then_it_is_one_byte() -> None:
    wire = SerialWire(2)
    assert wire.size(wire.encode(Symbol(1, 0, 5, 1))) == 1


@pytest.mark.parametrize(
    "message",
    [
        b"",
        b"\0",
        b"\x80",
        b"x",
        b"\xf3ab",
        b"\xf4ab",
        b"\xff" * 400,
        bytes(300),
        encode(Bye(1, Ending.OVER, "é")),
    ],
)
def test_when_any_message_is_stuffed_then_it_comes_back_and_no_code_looks_like_a_symbol(
    message: bytes,
) -> None:
    line = stuff(message)
    assert line[1] < 0x80
    assert unstuff(line[1:-1]) == (False, message)


def test_when_a_notice_is_stuffed_then_it_is_seven_bytes_and_known_as_one() -> None:
    line = stuff_notice(b"\1")
    assert len(line) == 7
    assert unstuff(line[1:-1]) == (True, b"\1")


def test_when_a_message_looks_like_a_notice_then_it_still_is_a_message() -> None:
    body = unstuff_content(stuff_notice(b"\1"))
    assert unstuff(stuff(body)[1:-1]) == (False, body)


def unstuff_content(line: bytes) -> bytes:
    from channel.links.serial.cobs import cobs_decode

    return cobs_decode(line[1:-1])


@pytest.mark.parametrize(
    ("stuffed", "kind"), [(b"\x05ab", "COBS"), (b"\x04abc", "checksum"), (b"\x01", "checksum")]
)
def test_when_a_frame_is_damaged_then_the_kind_of_damage_is_reported(stuffed: bytes, kind: str) -> None:
    with pytest.raises(FrameError, match=kind):
        unstuff(stuffed)
