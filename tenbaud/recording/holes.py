"""Gaps of a damaged recording: their times, and the missing ticks, samples and symbols."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any

import orjson

from tenbaud.recording.rows import KEY_MAX, KEYS

HOLES_METADATA = "holes"
"""Metadata of a recovered file: a JSON text for each hole, by its number."""
HOLES_MAX = 10_000
"""More than that are counted together with the last one."""

Missing = dict[str, tuple[int | None, int]]
"""topic -> first and last missing value of the field that counts its rows; first None: all before"""


@dataclass(frozen=True, slots=True)
class Hole:
    """A stretch of a recording that was damaged, between rows that are whole."""

    from_s: float
    """flight time of the last row before it"""
    to_s: float | None
    """of the first row behind it; None: nothing comes behind"""
    reason: str
    missing: Missing = field(default_factory=dict)
    keys: dict[str, str] = field(default_factory=dict)
    """topic -> what counts its rows: tick, sample or slot"""

    def __str__(self) -> str:
        until = "the end" if self.to_s is None else f"{self.to_s:.3f} s"
        return f"{self.from_s:.3f} s to {until}: {self.what}; {self.reason}"

    @property
    def what(self) -> str:
        """The gap as a sentence."""
        parts = []
        for topic, (first, last) in self.missing.items():
            key = self.keys.get(topic, "row")
            if first is None:
                parts.append(f"{topic} up to {key} {last}")
            elif first == last:
                parts.append(f"{topic} of {key} {first}")
            else:
                parts.append(f"{topic} of {key}s {first} to {last}")
        if not parts and self.to_s is None:
            return "what came then is lost"
        return "missing " + ", ".join(parts) if parts else "no tick, sample or symbol is missing"


def packed_holes(holes: list[Hole]) -> dict[str, str]:
    """Return the holes as the metadata of a recovered file."""
    return {str(number): orjson.dumps(asdict(hole)).decode() for number, hole in enumerate(holes)}


def unpacked_holes(metadata: dict[str, str]) -> list[Hole]:
    """Return the holes that a recovered file tells of; of one that cannot be read only that it is."""
    holes = []
    for text in list(metadata.values())[:HOLES_MAX]:
        try:
            holes.append(_unpacked(orjson.loads(text)))
        except (ValueError, KeyError, TypeError, AttributeError):
            holes.append(Hole(0.0, None, "what the recovered file says of this hole is damaged"))
    return holes


def _unpacked(told: dict[str, Any]) -> Hole:
    missing: Missing = {}
    for topic, (first, last) in told["missing"].items():
        missing[topic] = (None if first is None else _key(first), _key(last))
    keys = {topic: key for topic, key in told["keys"].items() if key in KEYS}
    to_s = None if told["to_s"] is None else float(told["to_s"])
    return Hole(float(told["from_s"]), to_s, str(told["reason"]), missing, keys)


def _key(value: Any) -> int:
    if type(value) is not int or abs(value) > KEY_MAX:
        raise ValueError("not the number of a tick, sample or slot")
    return value
