"""What composers and readers of the messages share; it needs no schema, and imports on bare Python."""

from __future__ import annotations

from math import isfinite
from typing import Any

from channel.codec.signals import Signal

SCHEMA_VERSION = 3
TAPE_SHOWS = ("erased", "late_symbol")
OF_TRANSMITTER = ("desync", "rejoin", "ended")
"""Events that the receiver reports as well."""


def named_signal(one: Signal) -> dict[str, Any]:
    """Return a signal as the messages name it."""
    low, high = (value if isfinite(value) else None for value in (one.low, one.high))
    return {"name": one.name, "unit": one.unit, "low": low, "high": high}


def is_shown(event: dict[str, Any]) -> bool:
    """Return whether the page lists an event: not what passes by itself or is reported twice."""
    kind = event["kind"]
    if kind in TAPE_SHOWS or event.get("state") == "holding":
        return False
    return event["role"] == "transmitter" or kind not in OF_TRANSMITTER
