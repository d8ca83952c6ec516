"""Lines of the virtual clock that are streams of bytes: what a serial line does to messages."""

from __future__ import annotations

import random
from collections import Counter

from channel.line.line import Delivery
from channel.links.serial.stream import Deframer
from channel.links.serial.wire import SerialWire, stuff


class StreamLine:
    """One direction of a serial line on the virtual clock, damaging a share of its bytes.

    Messages become the bytes of the line, some bytes change, and the stream is cut into messages again
    by the deframer that the real link uses. The first `spared` messages, the handshake, pass unharmed.
    """

    def __init__(
        self,
        wire: SerialWire,
        damage: float,
        seed: int,
        *,
        upward: bool,
        spared: int = 1,
    ) -> None:
        self.longest_delay_ns = 0
        self.counts: Counter[str] = Counter()
        self.dropped: Counter[str] = Counter()
        self.bytes_carried = 0
        self.bytes_damaged = 0
        self.symbols_changed = 0
        """symbol bytes that arrived as another valid symbol"""
        self._wire = wire
        self._damage = damage
        self._chooser = random.Random(seed)
        self._deframer = Deframer(wire if upward else None, self._drop)
        self._spared = spared

    def carry(self, data: bytes, now_ns: int) -> list[Delivery]:
        is_symbol = self._wire.is_symbol(data)
        raw = data if is_symbol else stuff(data)
        if self._spared:
            self._spared -= 1
            damaged = raw
        else:
            damaged = bytes(self._maybe_damaged(byte) for byte in raw)
        self.symbols_changed += is_symbol and damaged != raw and self._wire.is_symbol(damaged)
        self.bytes_carried += len(raw)
        messages = [received.message for received in self._deframer.feed(damaged)]
        return [Delivery(now_ns, message) for message in messages or [None]]

    def _maybe_damaged(self, byte: int) -> int:
        if self._chooser.random() >= self._damage:
            return byte
        self.bytes_damaged += 1
        return byte ^ self._chooser.randrange(1, 256)

    def _drop(self, kind: str) -> None:
        self.dropped[kind] += 1
