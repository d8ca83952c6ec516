"""Symmetric matrices of which a coder's state keeps the lower half, row by row."""

from __future__ import annotations

from channel.codec.coders.base import Numbers, Results


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
