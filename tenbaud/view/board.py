"""The data of the page: the two streams of one flight, joined, and their recent past.

Browsers come late and lag. Each gets the whole memory first and then what is new, as the same ready
bytes for all of them.
"""

from __future__ import annotations

from collections import deque
from typing import Any, NamedTuple

import orjson

from tenbaud.sentences import events
from tenbaud.telemetry.common import SCHEMA_VERSION, is_shown

POINTS_KEPT = 1200
SAMPLES_KEPT = 160
EVENTS_KEPT = 40
NEWS_KEPT = 60
SILENCE_S = 2.0
"""After this silence of the flight that is shown, another one may take its place."""

HEAD_WITHOUT = ("points", "samples", "events")


class News(NamedTuple):
    """The changes at one moment, as the browsers get them."""

    number: int
    data: bytes


class Board:
    """Takes messages in, gives news out; one thread only. `now_s` is a steady clock."""

    def __init__(self) -> None:
        self.heads: dict[str, dict[str, Any]] = {}
        """newest message of each end, without its lists"""
        self.heard_s: dict[str, float] = {}
        self.flight = 0
        self.foreign = 0
        """messages that were no telemetry of this version"""
        self._kept: dict[str, deque[Any]] = {
            "points": deque(maxlen=POINTS_KEPT),
            "decisions": deque(maxlen=POINTS_KEPT),
            "events": deque(maxlen=EVENTS_KEPT),
        }
        self._samples: dict[int, list[Any]] = {}
        self._news: deque[News] = deque(maxlen=NEWS_KEPT)
        self._index = 0
        self._fresh = self._nothing()

    def take(self, messages: list[bytes], now_s: float) -> bool:
        for data in messages:
            try:
                self._one(orjson.loads(data), now_s)
            except (orjson.JSONDecodeError, KeyError, TypeError, ValueError):
                self.foreign += 1
        fresh = self._fresh
        if not fresh["heads"] and not fresh.get("reset"):
            return False
        fresh["samples"] = list(fresh["samples"].values())
        self._index += 1
        self._news.append(News(self._index, orjson.dumps(fresh)))
        self._fresh = self._nothing()
        return True

    def since(self, index: int) -> tuple[int, list[bytes]]:
        """Return (index reached, what is new since `index`); 0 or too long ago: everything."""
        if index == self._index and index:
            return index, []
        if index and self._news and self._news[0].number <= index + 1:
            return self._index, [news.data for news in self._news if news.number > index]
        return max(self._index, 1), [self._everything()]

    def silent_s(self, now_s: float) -> float | None:
        """Return how long the flight shown has been silent; None when nothing was ever heard."""
        return now_s - max(self.heard_s.values()) if self.heard_s else None

    def _one(self, message: dict[str, Any], now_s: float) -> None:
        if message["version"] != SCHEMA_VERSION:
            raise ValueError("another version of the telemetry")
        role, flight = message["role"], message["flight"]
        if role not in ("transmitter", "receiver"):
            raise ValueError("no end of a flight")
        if flight != self.flight and not self._turns_to(flight, now_s):
            return
        self.heard_s[role] = now_s
        head = {name: value for name, value in message.items() if name not in HEAD_WITHOUT}
        self.heads[role] = self._fresh["heads"][role] = head
        if role == "transmitter":
            self._on_transmitter(message)
        else:
            self._on_receiver(message)
        for event in message["events"]:
            row = {"role": role, **event, "text": events.event_text(event)}
            if is_shown(row):
                self._keep("events", row)

    def _turns_to(self, flight: int, now_s: float) -> bool:
        """Return whether to show this flight now, instead of the one shown so far."""
        silent = self.silent_s(now_s)
        shown = self.heads.get("transmitter")
        # Before its handshake a transmitter has no number, and a receiver not yet a flight.
        over = shown is None or shown["phase"] == "ended" or self.flight == 0
        if silent is not None and silent < SILENCE_S and not (over and flight):
            return False
        self.flight = flight
        self.heads.clear()
        self.heard_s.clear()
        self._samples.clear()
        for kept in self._kept.values():
            kept.clear()
        self._fresh = {**self._nothing(), "reset": True}
        return True

    def _on_transmitter(self, message: dict[str, Any]) -> None:
        for point in message["points"]:
            values = point["measured"] if point["true"] is None else point["true"]
            self._keep("points", [point["time_s"], values, point["coded"], point["range"]])
        for sample in message["samples"]:
            kept = self._sample(sample["sample"])
            kept[1], kept[2] = sample["word_sent"], sample["word"]
            # On the narrow downlink no digest comes: the receiver's telemetry has the only one.
            kept[3], kept[4] = sample["digest"], sample["peer_digest"] or kept[4]
            kept[5] = sample["about"]

    def _on_receiver(self, message: dict[str, Any]) -> None:
        for point in message["points"]:
            self._keep("decisions", [point["time_s"], point["reference"]])
        for sample in message["samples"]:
            kept = self._sample(sample["sample"])
            kept[2] = sample["word"]
            # What came over the line is compared, where it is known already.
            if kept[3] is None or not kept[4]:
                kept[4] = sample["digest"]

    def _keep(self, name: str, row: Any) -> None:
        self._kept[name].append(row)
        self._fresh[name].append(row)

    def _sample(self, number: int) -> list[Any]:
        """Return the memory of a sample: number, word sent, word taken, both digests, outputs."""
        kept = self._samples.get(number)
        if kept is None:
            kept = self._samples[number] = [number, None, None, None, None, None]
            while len(self._samples) > SAMPLES_KEPT:
                del self._samples[next(iter(self._samples))]
        self._fresh["samples"][number] = kept
        return kept

    def _everything(self) -> bytes:
        lists = {name: list(kept) for name, kept in self._kept.items()}
        lists["samples"] = list(self._samples.values())
        return orjson.dumps({"reset": True, "heads": self.heads, **lists})

    @staticmethod
    def _nothing() -> dict[str, Any]:
        return {"heads": {}, "points": [], "decisions": [], "samples": {}, "events": []}
