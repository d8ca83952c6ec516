"""Consistent overhead byte stuffing (Cheshire and Baker): no zeros within, so that zero can delimit.

A message is cut at its zeros; each piece is preceded by its length plus one, and a piece of 254 bytes
without a zero by 255. The cost is one byte for up to 254.
"""

from __future__ import annotations

_RUN_MAX = 254


def cobs_encode(data: bytes) -> bytes:
    """Return the message without zeros; never empty."""
    out = bytearray()
    for piece in data.split(b"\0"):
        start = 0
        while len(piece) - start >= _RUN_MAX:
            out.append(_RUN_MAX + 1)
            out += piece[start : start + _RUN_MAX]
            start += _RUN_MAX
        out.append(len(piece) - start + 1)
        out += piece[start:]
    return bytes(out)


def cobs_decode(data: bytes) -> bytes:
    """Return the message that was encoded; ValueError for bytes that encode none."""
    out = bytearray()
    place = 0
    while place < len(data):
        code = data[place]
        end = place + code
        if code == 0 or end > len(data):
            raise ValueError(f"code {code} at byte {place} of {len(data)}")
        piece = data[place + 1 : end]
        if 0 in piece:
            raise ValueError(f"a zero within the run at byte {place}")
        out += piece
        place = end
        if code <= _RUN_MAX and place < len(data):
            out.append(0)
    if place == 0:
        raise ValueError("no bytes at all")
    return bytes(out)
