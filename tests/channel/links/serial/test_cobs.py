from __future__ import annotations

import random

import pytest

from channel.links.serial.cobs import cobs_decode, cobs_encode

# The examples of the article that introduced the code, and its edges around runs of 254.
VECTORS = [
    (b"", b"\x01"),
    (b"\x00", b"\x01\x01"),
    (b"\x00\x00", b"\x01\x01\x01"),
    (b"\x11\x22\x00\x33", b"\x03\x11\x22\x02\x33"),
    (b"\x11\x22\x33\x44", b"\x05\x11\x22\x33\x44"),
    (b"\x11\x00\x00\x00", b"\x02\x11\x01\x01\x01"),
    (b"\x01" * 253, b"\xfe" + b"\x01" * 253),
    (b"\x01" * 254, b"\xff" + b"\x01" * 254),
    (b"\x01" * 255, b"\xff" + b"\x01" * 254 + b"\x02\x01"),
    (b"\x01" * 254 + b"\x00", b"\xff" + b"\x01" * 254 + b"\x01\x01"),
]


@pytest.mark.parametrize(("message", "stuffed"), VECTORS, ids=range(len(VECTORS)))
def test_when_a_known_message_is_encoded_then_its_known_bytes_come(
    message: bytes, stuffed: bytes
) -> None:
    assert cobs_encode(message) == stuffed
    assert cobs_decode(stuffed) == message


def test_when_the_last_full_run_has_a_closing_code_then_it_is_decoded_all_the_same() -> None:
    assert cobs_decode(b"\xff" + b"\x01" * 254 + b"\x01") == b"\x01" * 254


def test_when_any_message_is_encoded_then_no_zero_is_in_it_and_it_comes_back() -> None:
    chooser = random.Random(5)
    for _ in range(2000):
        zeros = chooser.random()
        length = chooser.randrange(0, 900)
        message = bytes(
            0 if chooser.random() < zeros * zeros else chooser.randrange(256) for _ in range(length)
        )
        stuffed = cobs_encode(message)
        assert 0 not in stuffed
        assert len(message) < len(stuffed) <= len(message) + len(message) // 254 + 1
        assert cobs_decode(stuffed) == message


@pytest.mark.parametrize("data", [b"", b"\x02", b"\x03\x01", b"\x03\x01\x00", b"\x00", b"\x01\x00"])
def test_when_bytes_encode_nothing_then_it_is_a_value_error(data: bytes) -> None:
    with pytest.raises(ValueError):
        cobs_decode(data)
