"""The binary format: COBS frames with a CRC-16, for a microcontroller at some hundred samples/s.

    SAMPLE   <BBHIiii   0x01, flags, sequence, t_us, counts of channels 0, 1, 2    24 bytes on the line
    COMMAND  <BBHff     0x81, flags (1 enable, 2 zero the encoders), sequence, two voltages   16 bytes

Little-endian; the CRC-16/CCITT-FALSE of the payload follows it, low byte first; then COBS, then 0x00.
"""

from __future__ import annotations

import struct
from collections import Counter

from channel.links.serial.cobs import cobs_decode, cobs_encode
from transmitter.rigs.formats.framing import Cutter, crc16
from transmitter.rigs.formats.samples import DeviceFlag, RawSample, Wraps

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


class CobsFormat:
    """This end of the binary format."""

    name = "cobs"
    wraps = Wraps()
    greeting = b""
    poll = b""
    has_output = True

    def __init__(self) -> None:
        self.counts: Counter[str] = Counter()
        self._cutter = Cutter(0, FRAME_BYTES_MAX)

    def reset(self) -> None:
        """Wait for the next zero."""
        self._cutter.reset()

    def feed(self, data: bytes) -> list[RawSample]:
        """Return the samples in these bytes."""
        samples = []
        for piece in self._cutter.feed(data):
            if not piece:
                continue
            try:
                payload = unseal(piece)
            except ValueError:
                self.counts["bad_frames"] += 1
                continue
            if payload[0] != SAMPLE_TYPE or len(payload) != SAMPLE.size:
                self.counts["foreign"] += 1
                continue
            _, flags, sequence, time_us, *counts = SAMPLE.unpack(payload)
            # Bits that a later firmware may use are not ours to judge.
            samples.append(RawSample(tuple(counts), sequence, time_us, DeviceFlag(flags & 0x0F)))
        return samples

    def command(self, sequence: int, volts: tuple[float, ...], enable: bool) -> bytes:
        """Return a COMMAND frame."""
        flags = ENABLE if enable else 0
        return seal(COMMAND.pack(COMMAND_TYPE, flags, sequence & 0xFFFF, *volts))
