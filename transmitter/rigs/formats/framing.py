"""Bytes to messages: the checks of the rigs' formats, and cutting a stream at its delimiters."""

from __future__ import annotations

from binascii import crc_hqx

from channel.protocol.wire import CRC_START


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

    def __init__(self, delimiter: bytes, bytes_max: int) -> None:
        self._delimiter = delimiter
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
