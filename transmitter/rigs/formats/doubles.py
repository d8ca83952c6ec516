"""Vectors of doubles without any framing, as QUARC's Stream blocks send them.

`N` doubles are `8 N` bytes and nothing else: no length, no type, no checksum. Alignment that is lost
is lost for good, so a unit that makes no sense is an error and the caller reconnects.
"""

from __future__ import annotations

import math
import struct
from typing import Literal

from transmitter.rigs.formats.samples import DeviceFlag, RawSample, Wraps, flags_of

ByteOrder = Literal["little", "big"]
AngleUnit = Literal["counts", "rad", "deg"]
PLAUSIBLE_MAX = 1e10
PLAUSIBLE_MIN = 1e-100
"""A double whose bytes are swapped is nearly always zero to the eye or astronomical."""

WRAPS = Wraps(sequence=1 << 53, device_us=1 << 62)


def doubles(count: int, byte_order: str) -> struct.Struct:
    """Return the layout of `count` doubles in a row."""
    return struct.Struct(f"{'<' if byte_order == 'little' else '>'}{count}d")


class UnitError(ValueError):
    """An impossible unit: alignment or byte order is lost."""


class DoublesLayout:
    """Names and scales of the doubles in one direction's unit.

    `fields` for what comes in: `seq`, `time_s`, `flags` (those of the other formats), `c0` ... `c9`
    (the channels of travel, pitch and elevation), `-`. An angle in rad or deg is turned into counts
    with `counts_per_turn` of its channel.
    """

    wraps = WRAPS

    def __init__(
        self,
        fields: tuple[str, ...],
        byte_order: ByteOrder = "little",
        unit: AngleUnit = "counts",
        counts_per_turn: dict[int, int] | None = None,
    ) -> None:
        self.fields = fields
        self.struct = doubles(len(fields), byte_order)
        self.byte_order = byte_order
        turn = {"counts": None, "rad": math.tau, "deg": 360.0}[unit]
        self._scales = {
            channel: 1.0 if turn is None else counts / turn
            for channel, counts in (counts_per_turn or {}).items()
        }

    def decode(self, data: bytes) -> RawSample:
        """Return the sample in one unit; UnitError for one that cannot be right."""
        values = self.struct.unpack(data)
        counts: dict[int, int] = {}
        sequence = time_us = None
        flags = DeviceFlag(0)
        for name, value in zip(self.fields, values, strict=True):
            self._check(name, value)
            if name == "-":
                continue
            if name == "seq":
                sequence = round(value)
            elif name == "time_s":
                time_us = round(value * 1e6)
            elif name == "flags":
                flags = flags_of(round(value) & 0xFF)
                if value != float(flags):  # more than flags, so the firmware's own bits
                    flags &= DeviceFlag(0x0F)
            else:
                channel = int(name[1:])
                counts[channel] = math.floor(value * self._scales.get(channel, 1.0) + 0.5)
        found = tuple(counts.get(index, 0) for index in range(max(counts) + 1))
        return RawSample(found, sequence, time_us, flags)

    def _check(self, name: str, value: float) -> None:
        if math.isfinite(value) and (value == 0.0 or PLAUSIBLE_MIN < abs(value) < PLAUSIBLE_MAX):
            return
        raise UnitError(
            f"element {name} is {value!r}: the other end sends another number of doubles than "
            f"{len(self.fields)}, or not in byte order '{self.byte_order}'"
        )
