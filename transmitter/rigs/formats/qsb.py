"""The QSB of US Digital: one encoder per USB adapter, registers in hexadecimal text, no outputs.

The counter (register 0E) streams after `S0E`: `s0E` + 8 hexadecimal digits, with a time stamp of 8
more when register 15 asks for one, then `!` and CR LF. Replies repeat the letter of the request, in
either case; `e` begins an error. Older firmware leaves the `!` out.

Several adapters are several ports that share no clock, so only a host arrival time means anything; the
device's stamp (about 1.95 ms a step) is used for gaps in time alone.
"""

from __future__ import annotations

import re

from transmitter.rigs.formats.base import SerialFormat
from transmitter.rigs.formats.samples import RawSample, Wraps

LINE_BYTES_MAX = 80
STAMP_US = 1_953
"""One step of the adapter's time stamp, 1/512 s."""

_REPLY = re.compile(rb"[sSrR]0[eE]([0-9a-fA-F]{8})([0-9a-fA-F]{8})?!?")
_OTHER = re.compile(rb"[rRwWsS][0-9a-fA-F]{2}[0-9a-fA-F]*!?")

GREETING = b"W000\nW0B0\nW0C0\nW157\nS0E\n"
"""Quadrature, send always, at the fastest interval, LF and CR and time stamp, then stream."""


class QsbFormat(SerialFormat):
    """This end of one adapter."""

    name = "qsb"
    # The stamp has 32 bits; in microseconds it wraps at 2^32 steps.
    wraps = Wraps(device_us=(1 << 32) * STAMP_US)
    greeting = GREETING
    has_output = False

    def __init__(self) -> None:
        super().__init__(b"\n", LINE_BYTES_MAX)

    def command(self, sequence: int, volts: tuple[float, ...], enable: bool) -> bytes:
        """Return nothing: the adapter has no outputs."""
        return b""

    def _sample(self, piece: bytes) -> RawSample | None:
        text = piece.strip().replace(b" ", b"")
        match = _REPLY.fullmatch(text)
        if match is None:
            if text and not _OTHER.fullmatch(text):
                raise ValueError("neither a count nor a reply")
            return None
        counts = int(match[1], 16)
        if counts >= 1 << 31:
            counts -= 1 << 32
        stamp = None if match[2] is None else int(match[2], 16) * STAMP_US
        return RawSample((counts,), None, stamp)
