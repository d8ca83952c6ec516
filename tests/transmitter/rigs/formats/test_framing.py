from __future__ import annotations

import contextlib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from channel.links.serial.cobs import cobs_decode, cobs_encode
from transmitter.rigs.formats.base import Cutter, crc16, xor_checksum

ZEROES_AND_RUNS = st.lists(
    st.one_of(st.just(b"\0"), st.binary(max_size=5), st.integers(250, 260).map(lambda n: b"\x07" * n)),
    max_size=6,
).map(b"".join)


@pytest.mark.parametrize(
    ("data", "encoded"),
    [
        # The examples of the paper that introduced the method, and its edge at 254 bytes.
        (b"", "01"),
        (b"\0", "0101"),
        (b"\0\0", "010101"),
        (bytes([0x11, 0x22, 0, 0x33]), "0311220233"),
        (bytes([0x11, 0, 0, 0]), "0211010101"),
        (bytes(range(1, 255)), "ff" + bytes(range(1, 255)).hex()),
        (b"\0" + bytes(range(1, 255)), "01ff" + bytes(range(1, 255)).hex()),
        (bytes(range(1, 256)), "ff" + bytes(range(1, 255)).hex() + "02ff"),
        (bytes(range(1, 255)) + b"\0", "ff" + bytes(range(1, 255)).hex() + "0101"),
    ],
)
def test_known_encodings(data: bytes, encoded: str) -> None:
    assert cobs_encode(data).hex() == encoded
    assert cobs_decode(bytes.fromhex(encoded)) == data


@given(ZEROES_AND_RUNS)
def test_whatever_is_encoded_has_no_zero_and_comes_back(data: bytes) -> None:
    encoded = cobs_encode(data)
    assert 0 not in encoded
    assert cobs_decode(encoded) == data


@given(st.binary(max_size=40))
def test_garbage_is_decoded_or_refused_and_nothing_else(data: bytes) -> None:
    with contextlib.suppress(ValueError):
        assert len(cobs_decode(data)) < len(data)


@pytest.mark.parametrize("data", [b"", b"\0", b"\x05\x01", b"\x03\x01\0", b"\x02\x01\0"])
def test_what_no_encoder_writes_is_refused(data: bytes) -> None:
    with pytest.raises(ValueError, match="COBS"):
        cobs_decode(data)


def test_checksums() -> None:
    assert crc16(b"123456789") == 0x29B1
    assert xor_checksum(b"GPGLL,5300.97914,N,00259.98174,E,125926,A") == 0x28


def test_a_cutter_begins_at_the_first_delimiter_and_keeps_halves() -> None:
    cutter = Cutter(b"\0", 10)
    assert cutter.feed(b"half\0one\0tw") == [b"one"]
    assert cutter.feed(b"o\0") == [b"two"]
    cutter.reset()
    assert cutter.feed(b"rest\0next\0") == [b"next"]


def test_a_stream_without_delimiters_fills_no_memory() -> None:
    cutter = Cutter(b"\0", 10)
    for _ in range(100):
        assert cutter.feed(b"\x01" * 50) == []
    assert cutter.overlong == 100
    assert cutter.feed(b"\0good\0") == [b"good"]
