"""How an emulated device talks: the other side of every format."""

from __future__ import annotations

import math
import struct
from collections import Counter
from typing import NamedTuple, Protocol

from transmitter.rigs.formats.ascii import checked, unchecked
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
from transmitter.rigs.formats.qsb import STAMP_US
from transmitter.rigs.formats.samples import RawSample

COMMAND_BYTES_MAX = 200


class DeviceCommand(NamedTuple):
    """A command as the device understood it."""

    volts: tuple[float, float]
    enable: bool
    zero_encoders: bool = False


class Speech(Protocol):
    """The device's side of a format."""

    streams: bool
    """False: samples are sent only when asked for"""
    counts: Counter[str]
    """bad_commands"""

    def encode(self, sample: RawSample) -> bytes:
        """Return a sample as it goes onto the line."""

    def feed(self, data: bytes) -> tuple[list[DeviceCommand], int]:
        """Return the commands in these bytes, and how many samples they ask for."""


class CobsSpeech:
    """Binary frames."""

    streams = True

    def __init__(self) -> None:
        self.counts: Counter[str] = Counter()
        self._cutter = Cutter(b"\0", COMMAND_BYTES_MAX)

    def encode(self, sample: RawSample) -> bytes:
        sequence, time_us = (sample.sequence or 0) & 0xFFFF, (sample.device_us or 0) & 0xFFFFFFFF
        return seal(SAMPLE.pack(SAMPLE_TYPE, sample.flags, sequence, time_us, *sample.counts))

    def feed(self, data: bytes) -> tuple[list[DeviceCommand], int]:
        commands = []
        for piece in self._cutter.feed(data):
            try:
                kind, flags, _, front, rear = COMMAND.unpack(unseal(piece))
                if kind != COMMAND_TYPE or not (math.isfinite(front) and math.isfinite(rear)):
                    raise ValueError
            except (ValueError, struct.error):
                self.counts["bad_commands"] += 1
                continue
            zero = bool(flags & ZERO_ENCODERS)
            commands.append(DeviceCommand((front, rear), bool(flags & ENABLE), zero))
        return commands, 0


class AsciiSpeech:
    """Lines; `form` is what a sample line looks like."""

    def __init__(self, form: str = "checked", polled: bool = False) -> None:
        if form not in ("checked", "plain", "counts"):
            raise ValueError(f"line form {form!r}: checked, plain or counts")
        self.counts: Counter[str] = Counter()
        self.streams = not polled
        self._form = form
        self._rest = b""

    def encode(self, sample: RawSample) -> bytes:
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
        *lines, self._rest = (self._rest + data).replace(b"\r", b"\n").split(b"\n")
        self._rest = self._rest[-COMMAND_BYTES_MAX:]
        commands = []
        asked = 0
        for line in filter(None, lines):
            if line == b"e":
                asked += 1
                continue
            try:
                commands.append(_line_command(line))
            except ValueError:
                self.counts["bad_commands"] += 1
        return commands, asked


def _line_command(line: bytes) -> DeviceCommand:
    kind, *cells = unchecked(line).decode("ascii").split(",")
    if kind == "S" and not cells:
        return DeviceCommand((0.0, 0.0), False)
    if kind == "Z" and not cells:
        return DeviceCommand((0.0, 0.0), False, True)
    if kind != "U" or len(cells) != 3:
        raise ValueError(kind)
    front, rear = float(cells[1]), float(cells[2])
    if not (math.isfinite(front) and math.isfinite(rear)):
        raise ValueError("not finite")
    return DeviceCommand((front, rear), True)


class QsbSpeech:
    """One encoder, registers in hexadecimal; streams after `S0E`."""

    def __init__(self) -> None:
        self.counts: Counter[str] = Counter()
        self.streams = False
        self._stamped = False
        self._rest = b""

    def encode(self, sample: RawSample) -> bytes:
        """Return the counter as the adapter streams it."""
        text = f"s0E{sample.counts[1] & 0xFFFFFFFF:08X}"
        if self._stamped:
            text += f"{(sample.device_us or 0) // STAMP_US & 0xFFFFFFFF:08X}"
        return text.encode() + b"!\r\n"

    def feed(self, data: bytes) -> tuple[list[DeviceCommand], int]:
        """Take register writes; `S0E` starts the stream, `R0E` stops it and asks once."""
        *lines, self._rest = (self._rest + data).split(b"\n")
        asked = 0
        for line in filter(None, (line.strip().upper() for line in lines)):
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


class DoublesSpeech:
    """Units of doubles, as a QUARC model sends and takes them."""

    streams = True

    def __init__(
        self, fields: tuple[str, ...], commands: tuple[str, ...], byte_order: str, scale: float
    ) -> None:
        mark = "<" if byte_order == "little" else ">"
        self.counts: Counter[str] = Counter()
        self._fields = fields
        self._commands = commands
        self._scale = scale
        """turns a pitch count into the unit that is sent"""
        self._out = struct.Struct(f"{mark}{len(fields)}d")
        self._in = struct.Struct(f"{mark}{len(commands)}d")
        self._rest = b""

    def encode(self, sample: RawSample) -> bytes:
        known: dict[str, float] = {
            "seq": sample.sequence or 0,
            "time_s": (sample.device_us or 0) / 1e6,
            "flags": int(sample.flags),
        }
        for channel, counts in enumerate(sample.counts):
            known[f"c{channel}"] = counts * self._scale
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
