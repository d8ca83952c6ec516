"""Quantities as a person reads them: angles in degrees, everything else in its own unit."""

from __future__ import annotations

import math


def in_degrees(value: float, unit: str) -> tuple[float, str]:
    """Return a value as a person reads it, and its unit."""
    return (math.degrees(value), "deg") if unit == "rad" else (value, unit)


def amount(value: float, label: str, digits: int = 1) -> str:
    """Return a value with its label, a unit and what may follow it: `-3.5 deg of arm`.

    `digits` are those of an angle behind the point.
    """
    unit, of, name = label.partition(" of ")
    value, unit = in_degrees(value, unit)
    number = f"{value:.{digits}f}" if unit == "deg" else f"{value:.6g}"
    return f"{number} {unit}{of}{name}".strip()
