"""From a stream of bytes back to messages, even if bytes were lost, added or changed.

Outside a frame a byte with bit 7 and right check bits is a symbol, a zero opens a frame, and all else
is garbage. Inside, everything up to the next zero belongs to the frame. Nothing here waits for
anything, so the result does not depend on how the stream is cut into reads.

How it resynchronises:

* A frame that turns out damaged may have lost its closing zero, so the zero that ended it counts as
  the next one's beginning too.
* A byte from 0x80 on directly after a zero begins no frame (see `channel.links.serial.wire`): a symbol.
* Symbols that follow a half frame would be swallowed for ever, since no zero comes any more. A row of
  `RUN` symbol bytes with consecutive slot counters ends such a frame.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum
from typing import NamedTuple

from channel.errors import FrameError
from channel.links.serial.wire import STUFFED_BYTES_MAX, SYMBOL_MARK, SerialWire, unstuff

RUN = 6
"""In a frame's own bytes such a row turns up by chance once in 2^28 or less."""


class Received(NamedTuple):
    """One message off the line."""

    message: bytes
    is_notice: bool


class _State(Enum):
    OUTSIDE = 0
    BOUNDARY = 1
    """directly after a zero that may open a frame"""
    FRAME = 2
    SKIP = 3
    """within a frame that is too long to be one"""


class Deframer:
    """Takes bytes, gives messages; tells `on_drop` the kind of whatever was none.

    With `wire` None the direction carries no symbols: bytes outside frames are garbage.
    """

    def __init__(self, wire: SerialWire | None, on_drop: Callable[[str], None]) -> None:
        self._wire = wire
        self._drop = on_drop
        self._state = _State.OUTSIDE
        self._buffer = bytearray()
        self._run = 0
        self._run_slot = 0

    def feed(self, data: bytes) -> list[Received]:
        taken = (self._take(byte) for byte in data)
        return [received for received in taken if received is not None]

    def reset(self) -> None:
        """Forget a half frame, as after unplugging."""
        if self._state in (_State.FRAME, _State.SKIP):
            self._drop("half frame")
        self._state = _State.OUTSIDE
        self._forget()

    def _take(self, byte: int) -> Received | None:
        if byte == 0:
            return self._on_zero()
        if self._state in (_State.FRAME, _State.SKIP):
            return self._within(byte)
        if self._state is _State.BOUNDARY:
            if byte < SYMBOL_MARK:
                self._state = _State.FRAME
                self._buffer.append(byte)
                return None
            self._drop("stray zero")
            self._state = _State.OUTSIDE
        if self._wire is not None and self._wire.symbol(byte) is not None:
            return Received(bytes((byte,)), False)
        self._drop("garbage byte" if byte < SYMBOL_MARK else "check bits")
        return None

    def _on_zero(self) -> Received | None:
        state, stuffed = self._state, bytes(self._buffer)
        self._forget()
        self._state = _State.BOUNDARY
        if state is _State.BOUNDARY:
            self._drop("stray zero")
        if state is not _State.FRAME:
            return None
        try:
            is_notice, message = unstuff(stuffed, commands=self._wire is None)
        except FrameError as error:
            self._drop(str(error))
            return None
        self._state = _State.OUTSIDE
        return Received(message, is_notice)

    def _within(self, byte: int) -> Received | None:
        if self._state is _State.FRAME:
            self._buffer.append(byte)
            if len(self._buffer) > STUFFED_BYTES_MAX:
                self._drop("oversize")
                self._state = _State.SKIP
                self._buffer.clear()
        if not self._ends_run(byte):
            return None
        if self._state is _State.FRAME:
            self._drop("half frame")
        self._state = _State.OUTSIDE
        self._forget()
        return Received(bytes((byte,)), False)

    def _ends_run(self, byte: int) -> bool:
        symbol = None if self._wire is None else self._wire.symbol(byte)
        if symbol is None:
            self._run = 0
            return False
        follows = symbol.slot_low == (self._run_slot + 1) % symbol.slot_modulus
        self._run = self._run + 1 if self._run and follows else 1
        self._run_slot = symbol.slot_low
        return self._run >= RUN

    def _forget(self) -> None:
        self._buffer.clear()
        self._run = 0
