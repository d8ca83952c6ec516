"""Units of a log's columns: those in names, and conversions."""

from __future__ import annotations

import math
import re

_DIMENSIONS: dict[str, dict[str, float]] = {
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0},
    "angle": {"rad": 1.0, "mrad": 1e-3, "deg": math.pi / 180.0, "turn": math.tau},
    "rate": {"rad/s": 1.0, "deg/s": math.pi / 180.0, "rpm": math.tau / 60.0},
    "voltage": {"V": 1.0, "mV": 1e-3},
    "current": {"A": 1.0, "mA": 1e-3},
    "torque": {"N m": 1.0, "mN m": 1e-3},
    "length": {"m": 1.0, "cm": 1e-2, "mm": 1e-3},
    "share": {"1": 1.0, "%": 1e-2},
}
_FACTORS = {unit: (what, by) for what, units in _DIMENSIONS.items() for unit, by in units.items()}
_SPELLINGS = {
    "sec": "s", "secs": "s", "second": "s", "seconds": "s", "sek": "s", "sekunden": "s",
    "msec": "ms", "millis": "ms", "milliseconds": "ms", "usec": "us", "µs": "us", "μs": "us",
    "micros": "us", "microseconds": "us", "nanoseconds": "ns", "nsec": "ns",
    "radians": "rad", "radian": "rad", "degree": "deg", "degrees": "deg", "°": "deg", "grad": "deg",
    "rev": "turn", "turns": "turn", "revs": "turn",
    "rad/sec": "rad/s", "rads": "rad/s", "rad_s": "rad/s", "rad_per_s": "rad/s", "deg_per_s": "deg/s",
    "°/s": "deg/s", "1/min": "rpm", "u/min": "rpm",
    "v": "V", "volt": "V", "volts": "V", "mv": "mV", "millivolt": "mV", "millivolts": "mV",
    "a": "A", "amp": "A", "amps": "A", "ampere": "A", "amperes": "A", "ma": "mA",
    "nm": "N m", "n*m": "N m", "n.m": "N m", "n·m": "N m", "n-m": "N m", "mnm": "mN m",
    "percent": "%", "count": "counts", "ticks": "counts", "cnt": "counts", "cts": "counts",
    "inkremente": "counts", "pwm": "counts",
}  # fmt: skip
CLOCK_WORDS = (
    *("time", "t", "zeit", "timestamp", "clock", "seconds", "sec", "stamp", "temps", "tid"),
    *("times", "tout"),
)
"""Stems of the names of clocks, the likeliest first."""
COUNTS, DATE_TIME = "counts", "date-time"
_BRACKETS = re.compile(r"^(.*?)\s*[\[(<]\s*([^\[\]()<>]*?)\s*[\])>]\s*$")
_SEPARATORS = re.compile(r"( in |, |[_ ])")


def unit_named(text: str) -> str:
    """Return the unit that a text writes in one of its spellings; "" where it is none."""
    text = text.strip().strip("[]()<>").strip()
    for written in (text, text.lower(), text.lower().replace(" ", "")):
        unit = _SPELLINGS.get(written, written)
        if unit in _FACTORS or unit == COUNTS:
            return unit
    return ""


def split_unit(name: str) -> tuple[str, str]:
    """Return a column's name without its unit, and the unit: `angle_rad`, `Winkel [°]`, `u (V)`."""
    if found := _BRACKETS.match(name):
        return found[1] or name, unit_named(found[2])
    parts = _SEPARATORS.split(name)
    for end in range(1, len(parts), 2):
        # The longest end first: rad_per_s before s. One letter is as often a number's name: u_a.
        text = "".join(parts[end + 1 :])
        unit = unit_named(text)
        if unit and (len(text) > 1 or text in "sV°%"):
            return "".join(parts[:end]), unit
    return name, ""


def units_like(unit: str) -> list[str]:
    """Return the known units into which one converts; all where it is none of them."""
    what = _FACTORS.get(unit, ("", 1.0))[0]
    found = [one for one, (of, _) in _FACTORS.items() if what in ("", of)]
    return found + [COUNTS] * (what in ("", "angle"))


def is_speed(name: str) -> bool:
    """Return whether the name of a column says that it is a rate of something."""
    return bool(re.search(r"speed|omega|veloc|rate|rpm|drehzahl", name.casefold()))


def says_counts(name: str) -> bool:
    """Return whether the name of a column says that an encoder counts it."""
    return bool(re.search(r"count|encoder|tick|pulse|incr", name.casefold()))


def stem_of(name: str) -> str:
    """Return a column's name without unit, case and signs, for comparisons."""
    return re.sub(r"[^\w]+", "_", bare_name(name).strip().casefold().rpartition(".")[2]).strip("_")


def bare_name(name: str) -> str:
    """Return a column's name without its unit."""
    return split_unit(name)[0]


def turn_in(unit: str) -> float | None:
    """Return the length of a turn in the unit of an output, "" for rad; None where it has no turns."""
    return factor("turn", unit or "rad")


def factor(unit: str, into: str) -> float | None:
    """Return the factor from `unit` to `into`; None if there is none."""
    unit, into = unit_named(unit) or unit, unit_named(into) or into
    if not unit or not into or unit == into:
        return 1.0
    what, by = _FACTORS.get(unit, ("", 1.0))
    other, per = _FACTORS.get(into, ("?", 1.0))
    return by / per if what == other else None
