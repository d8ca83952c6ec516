"""What the one-bit coders share: a sign per measured axis, and gains that spread it over the state."""

from __future__ import annotations

from channel.codec import Vector
from channel.words import ERASED, Word

Gains = tuple[tuple[float, ...], ...]


def axes_of(gains: Gains) -> int:
    """Return the number of measured axes, one column each; ValueError for rows that do not match."""
    axes = len(gains[0]) if gains else 0
    if axes < 1 or any(len(row) != axes for row in gains):
        raise ValueError(f"gains need rows of equal, non-zero length, got {gains}")
    return axes


def signs_of(predicted: Vector, measurement: Vector, axes: int) -> tuple[int, ...]:
    """Return the sign of the estimation error of each axis (20); the sign of zero is +1."""
    return tuple(1 if measurement[axis] >= predicted[axis] else -1 for axis in range(axes))


def spread(errors: Vector, gains: Gains) -> Vector:
    """Return the correction of each model state: its row of gains times the axes' errors."""
    correction = []
    for row in gains:
        total = 0.0
        for axis in range(len(errors)):
            total += row[axis] * errors[axis]
        correction.append(total)
    return tuple(correction)


def scaled(ranges: Vector, word: Word) -> Vector:
    """Return the errors that a word stands for (21); an erased word stands for none."""
    if word is ERASED:
        return (0.0,) * len(ranges)
    return tuple(ranges[axis] * word[axis] for axis in range(len(ranges)))
