"""An emulated line that changes bytes and adds some, as real ones do."""

from __future__ import annotations

import random
from pathlib import Path

from channel.links.serial.emulated import EmulatedLine, Way


class NoisyLine(EmulatedLine):
    """Changes a share of the bytes, drawn from a seed."""

    def __init__(self, folder: Path, rate_baud: float | None, seed: int = 0) -> None:
        super().__init__(folder, rate_baud)
        self.damaged: dict[Way, int] = {"up": 0, "down": 0}
        self._shares: dict[Way, float] = {"up": 0.0, "down": 0.0}
        self._choosers: dict[Way, random.Random] = {
            "up": random.Random(2 * seed),
            "down": random.Random(2 * seed + 1),
        }

    def corrupt(self, way: Way, share: float) -> None:
        """Change this share of the bytes from now on."""
        self._shares[way] = share

    def inject(self, way: Way, data: bytes) -> None:
        """Put bytes on the line that nobody sent."""
        with self._lock:
            self.put(way, data)

    def put(self, way: Way, data: bytes) -> None:
        share, chooser = self._shares[way], self._choosers[way]
        changed = bytearray(data)
        for index in range(len(data)):
            if share and chooser.random() < share:
                changed[index] ^= chooser.randrange(1, 256)
                self.damaged[way] += 1
        super().put(way, bytes(changed))
