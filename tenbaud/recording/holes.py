"""Gaps of a damaged recording: their times, and the missing ticks, samples and symbols."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

import orjson

from channel.protocol.recording import RecordChannel
from tenbaud.recording.chunks import Damage, RawMessage
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
            holes.append(Hole(0.0, None, "the recovered file's entry of this gap is damaged"))
    return holes


def _unpacked(fields: dict[str, Any]) -> Hole:
    missing: Missing = {}
    for topic, (first, last) in fields["missing"].items():
        missing[topic] = (None if first is None else _key(first), _key(last))
    keys = {topic: key for topic, key in fields["keys"].items() if key in KEYS}
    to_s = None if fields["to_s"] is None else float(fields["to_s"])
    return Hole(float(fields["from_s"]), to_s, str(fields["reason"]), missing, keys)


def _key(value: Any) -> int:
    if type(value) is not int or abs(value) > KEY_MAX:
        raise ValueError("not the number of a tick, sample or slot")
    return value


BLOCKS_BEHIND = 64
"""Within this many blocks behind the damage a topic must continue, or its loss is not estimated."""

Newest = dict[int, RawMessage]
"""channel id -> a message"""


@dataclass(slots=True)
class _Gap:
    reason: str
    start: int
    end: int
    before: Newest
    behind: Newest = field(default_factory=dict)
    blocks: int = 0


class HoleFinder:
    """Takes damage and messages in the order of the file."""

    def __init__(self) -> None:
        self._gaps: list[_Gap] = []
        self._last: Newest = {}
        self._open: _Gap | None = None

    def on_damage(self, damage: Damage) -> None:
        if self._open is not None and not self._open.behind:
            self._open.end = damage.end
        elif len(self._gaps) < HOLES_MAX:
            self._open = _Gap(damage.reason, damage.start, damage.end, dict(self._last))
            self._gaps.append(self._open)

    def on_messages(self, messages: list[RawMessage]) -> None:
        if self._open is not None:
            first = {message[0]: message for message in reversed(messages)}
            self._open.behind = first | self._open.behind
            self._open.blocks += 1
            if (
                self._open.blocks >= BLOCKS_BEHIND
                or self._open.before.keys() <= self._open.behind.keys()
            ):
                self._open = None
        self._last.update({message[0]: message for message in messages})

    def holes(
        self, topics: Mapping[int, str | None], channels: Mapping[str, RecordChannel], ended: bool
    ) -> list[Hole]:
        """Return the holes so far.

        Damage with nothing behind it is none in a file that was cut, where everything ends so; it is
        one if the file has its end (`ended`).
        """
        return [_hole(gap, topics, channels) for gap in self._gaps if gap.behind or ended]


def _hole(gap: _Gap, topics: Mapping[int, str | None], channels: Mapping[str, RecordChannel]) -> Hole:
    missing: Missing = {}
    keys: dict[str, str] = {}
    for channel_id, message in gap.behind.items():
        topic = topics.get(channel_id)
        key = channels[topic].fields[0].name if topic is not None else ""
        behind = _value(message, key)
        if topic is None or key not in KEYS or behind is None:
            continue
        before = _value(gap.before[channel_id], key) if channel_id in gap.before else None
        if before is None and behind > 0:
            missing[topic] = (None, behind - 1)
        elif before is not None and behind > before + 1:
            missing[topic] = (before + 1, behind - 1)
        keys[topic] = key
    reason = f"{gap.reason}, bytes {gap.start} to {gap.end} of the file"
    from_s = max((time_ns for _, time_ns, _ in gap.before.values()), default=0) / 1e9
    behind_s = [time_ns / 1e9 for _, time_ns, _ in gap.behind.values()]
    to_s = min(behind_s, default=None)
    return Hole(from_s, to_s, reason, missing, {topic: keys[topic] for topic in missing})


def _value(message: RawMessage, key: str) -> int | None:
    try:
        value = orjson.loads(message[2])[key]
    except (ValueError, KeyError, TypeError, IndexError):
        return None
    return value if type(value) is int and abs(value) <= KEY_MAX else None
