"""Consistent overhead byte stuffing (Cheshire and Baker): no zeros within, so that zero can delimit.

A message is cut at its zeros; each piece is preceded by its length plus one, and a piece of 254 bytes
without a zero by 255. The cost is one byte for up to 254. A reader that comes in the middle, or lost a
byte, is right again at the next zero.
"""

from __future__ import annotations

_RUN_MAX = 0xFE
"""Longest run without a zero that one code byte stands for."""


def cobs_encode(data: bytes) -> bytes:
    """Return the data without zeros, the ending zero not included."""
    encoded = bytearray()
    runs = data.split(b"\0")
    for index, run in enumerate(runs):
        rest, full = run, False
        while len(rest) >= _RUN_MAX:
            encoded += b"\xff" + rest[:_RUN_MAX]
            rest, full = rest[_RUN_MAX:], True
        # A full run encodes no zero; at the very end nothing need follow it.
        if rest or not full or index + 1 < len(runs):
            encoded.append(len(rest) + 1)
            encoded += rest
    return bytes(encoded)


def cobs_decode(data: bytes) -> bytes:
    """Return the decoded bytes; ValueError for an invalid encoding."""
    if not data:
        raise ValueError("an empty COBS frame")
    decoded = bytearray()
    position = 0
    while position < len(data):
        code = data[position]
        end = position + code
        if code == 0:
            raise ValueError(f"a zero inside a COBS frame, at byte {position}")
        if end > len(data):
            raise ValueError(f"a COBS frame that ends {end - len(data)} bytes early")
        run = data[position + 1 : end]
        if 0 in run:
            raise ValueError(f"a zero inside a COBS frame, after byte {position}")
        decoded += run
        if code <= _RUN_MAX and end < len(data):
            decoded.append(0)
        position = end
    return bytes(decoded)
