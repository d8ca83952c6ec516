"""Bytes to messages and back: COBS, the CRC of the binary frames, and cutting at delimiters.

COBS (consistent overhead byte stuffing) removes every zero from a message, so that a zero can end it:
a reader that comes in the middle, or lost a byte, is right again at the next zero.
"""

from __future__ import annotations

from binascii import crc_hqx

CRC_START = 0xFFFF
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
        # A full run stands for no zero of its own; at the very end nothing need follow it.
        if rest or not full or index + 1 < len(runs):
            encoded.append(len(rest) + 1)
            encoded += rest
    return bytes(encoded)


def cobs_decode(data: bytes) -> bytes:
    """Return what was encoded; ValueError for bytes that no encoder writes."""
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


def crc16(data: bytes) -> int:
    """Return the CRC-16/CCITT-FALSE; that of b"123456789" is 0x29B1."""
    return crc_hqx(data, CRC_START)


def xor_checksum(text: bytes) -> int:
    """Return the exclusive or of all bytes, as in NMEA 0183."""
    value = 0
    for byte in text:
        value ^= byte
    return value


class Cutter:
    """Cuts a stream at a delimiter byte; what comes before the first one is not whole.

    A piece longer than `bytes_max` is dropped, so that a stream without delimiters cannot fill the
    memory; `overlong` counts them.
    """

    def __init__(self, delimiter: int, bytes_max: int) -> None:
        self._delimiter = bytes([delimiter])
        self._bytes_max = bytes_max
        self._rest = bytearray()
        self._synchronised = False
        self.overlong = 0

    def reset(self) -> None:
        """Forget what is half there: the stream begins anew."""
        self._rest.clear()
        self._synchronised = False

    def feed(self, data: bytes) -> list[bytes]:
        """Return the pieces that these bytes complete."""
        self._rest += data
        *pieces, rest = self._rest.split(self._delimiter)
        self._rest = bytearray(rest)
        if len(self._rest) > self._bytes_max:
            self.overlong += 1
            self.reset()
        if pieces and not self._synchronised:
            self._synchronised = True
            pieces = pieces[1:]
        whole = [bytes(piece) for piece in pieces if len(piece) <= self._bytes_max]
        self.overlong += len(pieces) - len(whole)
        return whole
