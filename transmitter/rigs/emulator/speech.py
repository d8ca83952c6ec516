"""The formats of an emulated device: the other side of each."""

from __future__ import annotations

import math
import struct
from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Callable, Mapping
from typing import NamedTuple

from transmitter.rigs.formats.ascii import EMULATOR_LINE, checked, unchecked
from transmitter.rigs.formats.base import Cutter
from transmitter.rigs.formats.cobs import (
    COMMAND,
    COMMAND_TYPE,
    ENABLE,
    SAMPLE,
    SAMPLE_TYPE,
    ZERO_ENCODERS,
    seal,
    unseal,
)
from transmitter.rigs.formats.doubles import doubles
from transmitter.rigs.formats.qsb import STAMP_US
from transmitter.rigs.formats.samples import DeviceFlag, RawSample

COMMAND_BYTES_MAX = 200
DECLARED_EVERY_US = 100_000
"""In lines of text, the emulator declares itself in a line as often."""


class DeviceCommand(NamedTuple):
    """A command as the device understood it."""

    volts: tuple[float, float]
    enable: bool
    zero_encoders: bool = False


class Speech(ABC):
    """The device's side of a format."""

    streams = True
    """False: samples are sent only when asked for"""

    def __init__(self) -> None:
        self.counts: Counter[str] = Counter()
        """bad_commands"""
        self._rest = b""

    @abstractmethod
    def encode(self, sample: RawSample) -> bytes:
        """Return a sample as it goes onto the line."""

    @abstractmethod
    def feed(self, data: bytes) -> tuple[list[DeviceCommand], int]:
        """Return the commands in these bytes, and how many samples they ask for."""

    def _lines(self, data: bytes) -> list[bytes]:
        """Return the lines that these bytes complete, empty ones left out."""
        *lines, self._rest = (self._rest + data).replace(b"\r", b"\n").split(b"\n")
        self._rest = self._rest[-COMMAND_BYTES_MAX:]
        return [line.strip() for line in lines if line.strip()]

    def _each(self, pieces: list[bytes], read: Callable[[bytes], DeviceCommand]) -> list[DeviceCommand]:
        """Return the commands in some pieces; invalid pieces are counted."""
        commands = []
        for piece in pieces:
            try:
                commands.append(read(piece))
            except (ValueError, struct.error):
                self.counts["bad_commands"] += 1
        return commands


class CobsSpeech(Speech):
    """Binary frames."""

    def __init__(self) -> None:
        super().__init__()
        self._cutter = Cutter(b"\0", COMMAND_BYTES_MAX)

    def encode(self, sample: RawSample) -> bytes:
        sequence, time_us = (sample.sequence or 0) & 0xFFFF, (sample.device_us or 0) & 0xFFFFFFFF
        return seal(SAMPLE.pack(SAMPLE_TYPE, sample.flags, sequence, time_us, *sample.counts))

    def feed(self, data: bytes) -> tuple[list[DeviceCommand], int]:
        return self._each(self._cutter.feed(data), _frame_command), 0


def _frame_command(piece: bytes) -> DeviceCommand:
    kind, flags, _, front, rear = COMMAND.unpack(unseal(piece))
    if kind != COMMAND_TYPE:
        raise ValueError(kind)
    return DeviceCommand(_finite(front, rear), bool(flags & ENABLE), bool(flags & ZERO_ENCODERS))


def _finite(front: float, rear: float) -> tuple[float, float]:
    if not (math.isfinite(front) and math.isfinite(rear)):
        raise ValueError("not finite")
    return front, rear


class AsciiSpeech(Speech):
    """Lines; `form` is what a sample line looks like."""

    def __init__(self, form: str = "checked", polled: bool = False) -> None:
        if form not in ("checked", "plain", "counts"):
            raise ValueError(f"line form {form!r}: checked, plain or counts")
        super().__init__()
        self.streams = not polled
        self._form = form
        self._declared_us: int | None = None

    def encode(self, sample: RawSample) -> bytes:
        now_us = sample.device_us or 0
        past = self._declared_us is None or not 0 <= now_us - self._declared_us < DECLARED_EVERY_US
        declares = DeviceFlag.EMULATED in sample.flags and past
        if declares:
            self._declared_us = now_us
        return (EMULATOR_LINE + b"\n" if declares else b"") + self._sample_line(sample)

    def _sample_line(self, sample: RawSample) -> bytes:
        cells = list(sample.counts)
        if self._form == "counts":
            return " ".join(map(str, cells)).encode() + b"\r\n"
        time_us = (sample.device_us or 0) & 0xFFFFFFFF
        if self._form == "plain":
            return ",".join(map(str, [time_us, *cells])).encode() + b"\r\n"
        sequence = (sample.sequence or 0) & 0xFFFF
        return checked(",".join(["E", *map(str, [sequence, time_us, *cells])]).encode())

    def feed(self, data: bytes) -> tuple[list[DeviceCommand], int]:
        """Return the `U`, `S` and `Z` lines; `e` asks for a sample."""
        lines = self._lines(data)
        return self._each([one for one in lines if one != b"e"], _line_command), lines.count(b"e")


def _line_command(line: bytes) -> DeviceCommand:
    kind, *cells = unchecked(line).decode("ascii").split(",")
    if kind == "S" and not cells:
        return DeviceCommand((0.0, 0.0), False)
    if kind == "Z" and not cells:
        return DeviceCommand((0.0, 0.0), False, True)
    if kind != "U" or len(cells) != 3:
        raise ValueError(kind)
    return DeviceCommand(_finite(float(cells[1]), float(cells[2])), True)


class QsbSpeech(Speech):
    """One encoder, registers in hexadecimal; streams after `S0E`."""

    def __init__(self) -> None:
        super().__init__()
        self.streams = False
        self._stamped = False

    def encode(self, sample: RawSample) -> bytes:
        text = f"s0E{sample.counts[1] & 0xFFFFFFFF:08X}"
        if self._stamped:
            text += f"{(sample.device_us or 0) // STAMP_US & 0xFFFFFFFF:08X}"
        return text.encode() + b"!\r\n"

    def feed(self, data: bytes) -> tuple[list[DeviceCommand], int]:
        """Take register writes; `S0E` starts the stream, `R0E` stops it and asks once."""
        asked = 0
        for line in map(bytes.upper, self._lines(data)):
            if line == b"S0E":
                self.streams = True
            elif line == b"R0E":
                self.streams = False
                asked += 1
            elif line.startswith(b"W15"):
                self._stamped = bool(int(line[3:] or b"0", 16) & 4)
            elif not line.startswith((b"W", b"R")):
                self.counts["bad_commands"] += 1
        return [], asked


class DoublesSpeech(Speech):
    """Units of doubles, as a QUARC model sends and takes them."""

    def __init__(
        self,
        fields: tuple[str, ...],
        commands: tuple[str, ...],
        byte_order: str,
        scales: Mapping[int, float],
    ) -> None:
        super().__init__()
        self._fields = fields
        self._commands = commands
        self._scales = scales
        """turn a channel's counts into the unit that is sent"""
        self._out = doubles(len(fields), byte_order)
        self._in = doubles(len(commands), byte_order)

    def encode(self, sample: RawSample) -> bytes:
        known: dict[str, float] = {
            "seq": sample.sequence or 0,
            "time_s": (sample.device_us or 0) / 1e6,
            "flags": int(sample.flags),
        }
        for channel, counts in enumerate(sample.counts):
            known[f"c{channel}"] = counts * self._scales.get(channel, 1.0)
        return self._out.pack(*(known.get(name, 0.0) for name in self._fields))

    def feed(self, data: bytes) -> tuple[list[DeviceCommand], int]:
        """Return the newest whole unit only, as the Stream block does; zeros mean off."""
        self._rest += data
        whole = len(self._rest) // self._in.size * self._in.size
        if not whole:
            return [], 0
        values = self._in.unpack(self._rest[whole - self._in.size : whole])
        self._rest = self._rest[whole:]
        named = dict(zip(self._commands, values, strict=True))
        volts = (named.get("v0", 0.0), named.get("v1", 0.0))
        if not (math.isfinite(volts[0]) and math.isfinite(volts[1])):
            self.counts["bad_commands"] += 1
            return [], 0
        enable = bool(named["enable"]) if "enable" in named else any(volts)
        return [DeviceCommand(volts, enable)], 0
