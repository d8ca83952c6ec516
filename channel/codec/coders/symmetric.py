"""Symmetric matrices of which a coder's state keeps the lower half, row by row."""

from __future__ import annotations

import math
from collections.abc import Sequence

from channel.codec.codec import Vector
from channel.codec.coders.base import Numbers, Results

Rows = Sequence[Sequence[float]]


def place(row: int, column: int) -> int:
    """Return where an entry of a symmetric matrix is, of which the lower half is kept row by row."""
    if row < column:
        return column * (column + 1) // 2 + row  # integers
    return row * (row + 1) // 2 + column  # integers


def write_full(coder: Numbers, n: int, full: Results) -> None:
    """Write the symmetric matrix of which `coder` begins with the lower half."""
    at = 0
    for i in range(n):
        for j in range(i + 1):
            full[i * n + j] = coder[at]
            full[j * n + i] = coder[at]
            at += 1


def variance_of(coder: Numbers, row: Numbers) -> float:
    """Return the variance of a sum of states, `row` being their factors."""
    total = 0.0
    for i in range(len(row)):
        for j in range(len(row)):
            total += row[i] * row[j] * coder[place(i, j)]
    return total


def most_correlated(readout: Rows, known: Numbers, v: Numbers) -> int:
    """Return the output C x for which (C v)^2 / (C P C') is largest, the first of equals.

    `readout` is C, and `known` begins with the lower half of P.
    """
    best, most = 0, 0.0
    for output, row in enumerate(readout):
        common = 0.0
        for i in range(len(row)):
            common += row[i] * v[i]
        variance = variance_of(known, row)
        if variance > 0.0 and common * common > most * variance:
            best, most = output, common * common / variance
    return best


def deviations(readout: Rows, known: Numbers, strength: float) -> Vector:
    """Return the standard deviation of each output C x under strength^2 P."""
    variances = [variance_of(known, row) for row in readout]
    return tuple([strength * math.sqrt(one if one > 0.0 else 0.0) for one in variances])


def check_symmetric(name: str, rows: Rows) -> None:
    """Raise ValueError, naming the entries, for a matrix that is not symmetric."""
    for row in range(len(rows)):
        for column in range(row + 1):
            if rows[row][column] != rows[column][row]:
                raise ValueError(
                    f"{name} must be symmetric, and its entries {row + 1}, {column + 1} differ"
                )
