"""Lines that lose and delay messages, each in its own way and always the same."""

from __future__ import annotations

import random

from channel.line.line import CleanLine, Delivery
from channel.protocol.wire import DATAGRAM

SEED = 20240617


class LossyLine(CleanLine):
    """Loses a share of the symbols, or the ones that are named."""

    def __init__(
        self, share: float = 0.0, lost: frozenset[int] = frozenset(), delay_ns: int = 0
    ) -> None:
        super().__init__(delay_ns)
        self._share = share
        self._lost = lost
        self._chooser = random.Random(SEED)
        self._symbols = 0
        self.losses = 0

    def carry(self, data: bytes, now_ns: int) -> list[Delivery]:
        deliveries = super().carry(data, now_ns)
        if DATAGRAM.is_symbol(data):
            number = self._symbols
            self._symbols += 1
            if number in self._lost or self._chooser.random() < self._share:
                self.losses += 1
                return [Delivery(delivery.arrival_ns, None) for delivery in deliveries]
        return deliveries


class JitterLine(CleanLine):
    """Delays each symbol by a random time from 0 to `jitter_ns`."""

    def __init__(self, jitter_ns: int) -> None:
        super().__init__()
        self._jitter_ns = jitter_ns
        self._chooser = random.Random(SEED)

    def carry(self, data: bytes, now_ns: int) -> list[Delivery]:
        extra_ns = self._chooser.randrange(self._jitter_ns + 1) if DATAGRAM.is_symbol(data) else 0
        return [Delivery(now_ns + extra_ns, data)]


class DelayingLine(CleanLine):
    """Delays the symbols that are named by `extra_ns`."""

    def __init__(self, numbers: frozenset[int], extra_ns: int) -> None:
        super().__init__()
        self._numbers = numbers
        self._extra_ns = extra_ns
        self._symbols = 0

    def carry(self, data: bytes, now_ns: int) -> list[Delivery]:
        is_symbol = DATAGRAM.is_symbol(data)
        extra_ns = self._extra_ns if is_symbol and self._symbols in self._numbers else 0
        self._symbols += is_symbol
        return [Delivery(now_ns + extra_ns, data)]


class SlowDownlink(CleanLine):
    """Takes its time for everything but the handshake."""

    def __init__(self, delay_ns: int) -> None:
        super().__init__()
        self._slow_ns = delay_ns
        self._frames = 0

    def carry(self, data: bytes, now_ns: int) -> list[Delivery]:
        self._frames += 1
        return [Delivery(now_ns + (self._slow_ns if self._frames > 1 else 0), data)]
