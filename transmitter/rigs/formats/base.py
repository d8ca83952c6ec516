"""The interface of a serial format: bytes to samples, commands to bytes."""

from __future__ import annotations

from abc import ABC, abstractmethod
from binascii import crc_hqx
from collections import Counter

from channel.protocol.wire import CRC_START
from transmitter.rigs.formats.samples import RawSample, Wraps


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
    """Cuts a stream at a delimiter byte; the bytes before the first one are incomplete.

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
        """Forget an incomplete piece: the stream restarts."""
        self._rest.clear()
        self._synchronised = False

    def feed(self, data: bytes) -> list[bytes]:
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


class SerialFormat(ABC):
    """One way in which a device talks. It keeps half-read bytes, so every port has its own."""

    name: str
    wraps = Wraps()
    greeting = b""
    """to send when the port has been opened"""
    poll = b""
    """to send for every sample; empty where the device streams by itself"""
    has_output = True
    """whether commands can be sent at all"""

    def __init__(self, delimiter: bytes, bytes_max: int) -> None:
        self.counts: Counter[str] = Counter()
        """bad_frames, log_lines, foreign"""
        self._cutter = Cutter(delimiter, bytes_max)

    def reset(self) -> None:
        """Forget an incomplete piece: the port was opened again."""
        self._cutter.reset()

    def feed(self, data: bytes) -> list[RawSample]:
        """Return the samples that these bytes complete; damaged ones are counted and dropped."""
        samples = []
        for piece in self._cutter.feed(data):
            try:
                sample = self._sample(piece)
            except ValueError:
                self.counts["bad_frames"] += 1
                continue
            if sample is not None:
                samples.append(sample)
        return samples

    @abstractmethod
    def command(self, sequence: int, volts: tuple[float, ...], enable: bool) -> bytes:
        """Return the message that puts voltages on the outputs, or turns them off."""

    @abstractmethod
    def _sample(self, piece: bytes) -> RawSample | None:
        """Return the sample in a piece of the stream, if any; ValueError for a damaged piece."""
