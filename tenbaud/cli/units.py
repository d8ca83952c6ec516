"""Numbers with units on the command line: `10%`, `90ms` and `45deg` become plain numbers.

Options take them, and fields whose names end in a unit, or are `mismatch`.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from decimal import Decimal

SHARE = {"%": "0.01"}
TIME = {"us": "0.000001", "ms": "0.001", "s": "1", "min": "60", "h": "3600"}
RATE = {"bit/s": "1", "baud": "1", "Hz": "1", "kHz": "1000"}
ANGLE = {"rad": "1", "deg": "0.017453292519943295"}

OPTIONS: Mapping[str, Mapping[str, str]] = {
    **dict.fromkeys(("--mismatch", "--train-share", "--shoves"), SHARE),
    **dict.fromkeys(("--duration", "--seconds", "--watchdog", "--period", "--from", "--to"), TIME),
    **dict.fromkeys(("--rate",), RATE),
    "--days": {"d": "1"},
    "--pace": {"x": "1"},
}
FIELDS: Mapping[str, Mapping[str, str]] = {
    "mismatch": SHARE,
    "_per_s": {},
    "_rad_s": {"rad/s": "1"},
    "_s": TIME,
    "_rad": ANGLE,
    "_hz": RATE,
    "_baud": RATE,
    "_volts": {"V": "1", "mV": "0.001"},
}
"""End of a field's name; the first that fits."""
_NUMBER = re.compile(r"([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?) ?([a-zA-Z%/]+)")


def plain_arguments(arguments: list[str]) -> list[str]:
    """Return a command's arguments, the values of `OPTIONS` without units.

    ValueError for a unit that the option does not have.
    """
    found: list[str] = []
    for before, argument in zip(["", *arguments], arguments, strict=False):
        name, equals, value = argument.partition("=")
        if equals and name in OPTIONS:
            argument = f"{name}={_option(name, value)}"
        elif before in OPTIONS:
            argument = _option(before, argument)
        found.append(argument)
    return found


def _option(name: str, text: str) -> str:
    units = OPTIONS[name]
    match = _NUMBER.fullmatch(text)
    if match is not None and match[2] not in units:
        known = ", ".join(f"{match[1]}{unit}" for unit in units)
        raise ValueError(f"{name}: '{text}' has an unknown unit; write {match[1]} or {known}")
    return _plain(text, units)


def plain_setting(field: str, text: str) -> str:
    """Return the value of a field of the configuration without its unit."""
    units = next((units for ending, units in FIELDS.items() if field.endswith(ending)), {})
    return _plain(text.strip(), units)


def _plain(text: str, units: Mapping[str, str]) -> str:
    """Return a number without its unit; any other text stays as it is."""
    match = _NUMBER.fullmatch(text)
    if match is None or match[2] not in units:
        return text
    try:
        return str(float(Decimal(match[1]) * Decimal(units[match[2]])))
    except ArithmeticError:
        return text
