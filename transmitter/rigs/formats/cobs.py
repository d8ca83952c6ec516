"""The binary format: COBS frames with a CRC-16, for a microcontroller at some hundred samples/s.

    SAMPLE   <BBHIiii   0x01, flags, sequence, t_us, counts of channels 0, 1, 2    24 bytes on the line
    COMMAND  <BBHff     0x81, flags (1 enable, 2 zero the encoders), sequence, two voltages   16 bytes

Little-endian; the CRC-16/CCITT-FALSE of the payload follows it, low byte first; then COBS, then 0x00.
"""

from __future__ import annotations

import struct

from channel.links.serial.cobs import cobs_decode, cobs_encode
from transmitter.rigs.formats.base import SerialFormat, crc16
from transmitter.rigs.formats.samples import RawSample, flags_of

SAMPLE_TYPE = 0x01
COMMAND_TYPE = 0x81
ENABLE = 1
ZERO_ENCODERS = 2
FRAME_BYTES_MAX = 64

SAMPLE = struct.Struct("<BBHIiii")
COMMAND = struct.Struct("<BBHff")
_CRC = struct.Struct("<H")


def seal(payload: bytes) -> bytes:
    """Return the frame of a payload: CRC, COBS and the ending zero."""
    return cobs_encode(payload + _CRC.pack(crc16(payload))) + b"\0"


def unseal(piece: bytes) -> bytes:
    """Return the payload of a frame without its zero; ValueError when it is damaged."""
    data = cobs_decode(piece)
    payload, crc = data[: -_CRC.size], data[-_CRC.size :]
    if len(payload) == 0 or _CRC.pack(crc16(payload)) != crc:
        raise ValueError("the checksum does not match")
    return payload


class CobsFormat(SerialFormat):
    """This end of the binary format."""

    name = "cobs"

    def __init__(self) -> None:
        super().__init__(b"\0", FRAME_BYTES_MAX)

    def command(self, sequence: int, volts: tuple[float, ...], enable: bool) -> bytes:
        flags = ENABLE if enable else 0
        return seal(COMMAND.pack(COMMAND_TYPE, flags, sequence & 0xFFFF, *volts))

    def _sample(self, piece: bytes) -> RawSample | None:
        if not piece:
            return None
        payload = unseal(piece)
        if payload[0] != SAMPLE_TYPE or len(payload) != SAMPLE.size:
            self.counts["foreign"] += 1
            return None
        _, flags, sequence, time_us, *counts = SAMPLE.unpack(payload)
        return RawSample(tuple(counts), sequence, time_us, flags_of(flags))
