"""Lines of text, as many sketches print them already.

A sample is one line, ended by LF or CR LF, with decimal columns between commas, spaces or tabs; which
column is what comes from the configuration. A line that begins with `E,` has a separate form, with a
sequence and a checksum: `E,seq,t_us,c0,c1,c2*HH`, `HH` being the exclusive or of all characters
before `*` in hexadecimal. Lines that begin with `#` are the device's log.

Commands back are `U,seq,v0,v1*HH` and `S*53` (stop). For the firmware of ros_arduino_bridge, which is
asked with `e` and a carriage return and takes raw pulse widths, commands are `o p0 p1`.
"""

from __future__ import annotations

import re
from typing import Literal

from transmitter.rigs.formats.base import SerialFormat, xor_checksum
from transmitter.rigs.formats.samples import DeviceFlag, RawSample

LINE_BYTES_MAX = 200
EMULATOR_LINE = b"# tenbaud rig emulator"
"""By this line of its log the rig emulator declares itself."""
COLUMN = re.compile(r"c\d|t_us|seq|-")
AXIS_COLUMNS = {"travel": "c0", "pitch": "c1", "elevation": "c2", "elev": "c2"}
DEFAULT_COLUMNS = ("t_us", "travel", "pitch", "elevation")
CHECKED_COLUMNS = ("seq", "t_us", "c0", "c1", "c2")
PULSE_FULL = 255
_SEPARATOR = re.compile(rb"[,\s]+")

CommandStyle = Literal["checked", "pulse"]


class AsciiFormat(SerialFormat):
    """This end of the text format.

    `columns` name what a plain line holds: `t_us`, `seq`, `c0` ... `c9` (or `travel`, `pitch`,
    `elevation` for c0 ... c2), `-` for a column to skip. `pulse_full_volts` is the voltage that the
    full pulse width stands for, for `command_style` "pulse". ValueError for columns without counts.
    """

    name = "ascii"

    def __init__(
        self,
        columns: tuple[str, ...] = DEFAULT_COLUMNS,
        poll: str = "",
        command_style: CommandStyle = "checked",
        pulse_full_volts: float = 12.0,
    ) -> None:
        super().__init__(b"\n", LINE_BYTES_MAX)
        self.poll = poll.encode()
        self._columns = _channels(columns)
        self._command_style = command_style
        self._pulse_full_volts = pulse_full_volts
        self._flags = DeviceFlag(0)

    def reset(self) -> None:
        super().reset()
        self._flags = DeviceFlag(0)

    def command(self, sequence: int, volts: tuple[float, ...], enable: bool) -> bytes:
        if self._command_style == "pulse":
            pulses = [round(value / self._pulse_full_volts * PULSE_FULL) for value in volts]
            wanted = pulses if enable else [0] * len(volts)
            limited = (min(max(value, -PULSE_FULL), PULSE_FULL) for value in wanted)
            return b"o " + " ".join(map(str, limited)).encode() + b"\r"
        if not enable:
            return checked(b"S")
        fields = ["U", str(sequence & 0xFFFF), *(f"{value:.4f}" for value in volts)]
        return checked(",".join(fields).encode())

    def _sample(self, piece: bytes) -> RawSample | None:
        text = piece.strip()
        if not text or text == b"OK":
            return None
        if text.startswith(b"#"):
            self.counts["log_lines"] += 1
            if text == EMULATOR_LINE:
                self._flags = DeviceFlag.EMULATED
            return None
        columns = self._columns
        if text.startswith(b"E,"):
            text, columns = unchecked(text)[2:], CHECKED_COLUMNS
        elif b"*" in text:
            text = unchecked(text)
        cells = [cell for cell in _SEPARATOR.split(text) if cell]
        if len(cells) != len(columns):
            raise ValueError(f"{len(cells)} columns, expected {len(columns)}")
        counts: dict[int, int] = {}
        sequence = time_us = None
        for name, cell in zip(columns, cells, strict=True):
            if name == "-":
                continue
            value = _whole(cell)
            if name == "seq":
                sequence = value % self.wraps.sequence
            elif name == "t_us":
                time_us = value % self.wraps.device_us
            else:
                counts[int(name[1:])] = value
        channels = tuple(counts.get(index, 0) for index in range(max(counts) + 1))
        return RawSample(channels, sequence, time_us, self._flags)


def checked(text: bytes) -> bytes:
    """Return a line with its checksum."""
    return text + f"*{xor_checksum(text):02X}\n".encode()


def unchecked(text: bytes) -> bytes:
    """Return a line without its checksum; ValueError when it does not match."""
    body, star, sum_text = text.rpartition(b"*")
    if not star or len(sum_text) != 2 or int(sum_text, 16) != xor_checksum(body):
        raise ValueError("the checksum does not match")
    return body


def _whole(cell: bytes) -> int:
    # int() would take 1_000 and a few more forms that no sketch prints.
    if not cell.lstrip(b"+-").isdigit():
        raise ValueError(f"{cell!r} is not a whole number")
    return int(cell)


def _channels(columns: tuple[str, ...]) -> tuple[str, ...]:
    names = tuple(AXIS_COLUMNS.get(name, name) for name in columns)
    for name in names:
        if not COLUMN.fullmatch(name):
            raise ValueError(
                f"column {name!r}: t_us, seq, c0 to c9, travel, pitch, elevation, or - to skip one"
            )
    used = [name for name in names if name != "-"]
    if len(set(used)) != len(used) or not any(name.startswith("c") for name in used):
        raise ValueError(f"columns {', '.join(columns)}: at least one count, and none twice")
    return names
