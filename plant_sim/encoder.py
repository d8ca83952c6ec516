"""The reading of an output: by an incremental encoder, in whole counts, or exactly."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, Final, TypeAlias


def counts_of(
    value: float, counts_per_turn: float, sign: int, zero_counts: int, turn: float = math.tau
) -> int:
    """Return the nearest count of a finite value; see `Encoder.counts`."""
    return sign * math.floor(value / turn * counts_per_turn + 0.5) + zero_counts


def angle_of(
    counts: int, counts_per_turn: float, sign: int, zero_counts: int, turn: float = math.tau
) -> float:
    """Return the value in the middle of those that read `counts`; see `Encoder.angle_rad`."""
    return sign * (counts - zero_counts) * turn / counts_per_turn


EXACT_PER_UNIT: Final = 2.0**40
"""Counts of an output that is read exactly; they only tell whether it moved."""


@dataclass(frozen=True, slots=True)
class Encoder:
    """An encoder that counts without bound: several turns are several times `counts_per_turn`.

    `counts_per_turn` is after quadrature and at least 1; `sign` is +1 or -1 and says which way the
    counts grow; `zero_counts` is what it reads at 0. `turn` is the value of
    `counts_per_turn` counts: 2 pi for an angle in rad, 1 for counts per unit of any other output.
    """

    counts_per_turn: float
    sign: int = 1
    zero_counts: int = 0
    turn: float = math.tau

    def __post_init__(self) -> None:
        if self.turn == math.tau and self.counts_per_turn < 1:
            raise ValueError(f"counts_per_turn is {self.counts_per_turn}; it must be at least 1")
        if self.sign not in (-1, 1):
            raise ValueError(f"sign is {self.sign}; it must be -1 or +1")

    def counts(self, angle_rad: float) -> int:
        """Return the nearest count; exactly between two, the one further in `sign`'s direction.

        Raises ValueError when the angle is not finite.
        """
        try:
            return counts_of(angle_rad, self.counts_per_turn, self.sign, self.zero_counts, self.turn)
        except (ValueError, OverflowError):
            raise ValueError(f"angle_rad is {angle_rad}; it must be finite") from None

    @property
    def step(self) -> float:
        """Return how far the values that it shows lie apart."""
        return self.turn / self.counts_per_turn

    def read(self, value: float) -> tuple[int, float]:
        """Return the count of a value, and the value that is made of it."""
        count = self.counts(value)
        return count, self.angle_rad(count)

    def angle_rad(self, counts: int) -> float:
        """Return the angle in the middle of the range of angles that read `counts`."""
        return angle_of(counts, self.counts_per_turn, self.sign, self.zero_counts, self.turn)


@dataclass(frozen=True, slots=True)
class ExactReader:
    """Reads a value as it is; its counts only tell whether the value moved."""

    step: ClassVar[float] = 0.0

    def read(self, value: float) -> tuple[int, float]:
        return math.floor(value * EXACT_PER_UNIT), value


OutputReader: TypeAlias = Encoder | ExactReader

QUANSER_PITCH: Final = Encoder(counts_per_turn=4096)
"""Pitch and elevation of a Quanser 3-DOF helicopter: 1024 lines, read in quadrature."""
