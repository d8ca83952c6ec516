"""An incremental encoder: angles become whole counts."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final


def counts_of(angle_rad: float, counts_per_turn: int, sign: int, zero_counts: int) -> int:
    """Return the nearest count of a finite angle; see `Encoder.counts`."""
    return sign * math.floor(angle_rad / math.tau * counts_per_turn + 0.5) + zero_counts


def angle_of(counts: int, counts_per_turn: int, sign: int, zero_counts: int) -> float:
    """Return the angle in the middle of those that read `counts`; see `Encoder.angle_rad`."""
    return sign * (counts - zero_counts) * math.tau / counts_per_turn


@dataclass(frozen=True, slots=True)
class Encoder:
    """An encoder that counts without bound: several turns are several times `counts_per_turn`.

    `counts_per_turn` is after quadrature and at least 1; `sign` is +1 or -1 and says which way the
    counts grow; `zero_counts` is what it reads at 0 rad.
    """

    counts_per_turn: int
    sign: int = 1
    zero_counts: int = 0

    def __post_init__(self) -> None:
        """Refuse an encoder that cannot be built."""
        if self.counts_per_turn < 1:
            raise ValueError(f"counts_per_turn is {self.counts_per_turn}; it must be at least 1")
        if self.sign not in (-1, 1):
            raise ValueError(f"sign is {self.sign}; it must be -1 or +1")

    def counts(self, angle_rad: float) -> int:
        """Return the nearest count; exactly between two, the one further in `sign`'s direction.

        Raises ValueError when the angle is not finite.
        """
        try:
            return counts_of(angle_rad, self.counts_per_turn, self.sign, self.zero_counts)
        except (ValueError, OverflowError):
            raise ValueError(f"angle_rad is {angle_rad}; it must be finite") from None

    def angle_rad(self, counts: int) -> float:
        """Return the angle in the middle of the range of angles that read `counts`."""
        return angle_of(counts, self.counts_per_turn, self.sign, self.zero_counts)


def angles_rad(encoders: tuple[Encoder, ...], counts: tuple[int, ...]) -> tuple[float, ...]:
    """Return the angles of several encoders from their counts, in the same order."""
    return tuple(one.angle_rad(count) for one, count in zip(encoders, counts, strict=True))


TEN_BITS: Final = Encoder(counts_per_turn=1024)
"""The paper's: 10 bits a turn."""

QUANSER_PITCH: Final = Encoder(counts_per_turn=4096)
"""Pitch and elevation of a Quanser 3-DOF helicopter: 1024 lines, read in quadrature."""
