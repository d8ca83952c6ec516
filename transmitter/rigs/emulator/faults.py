"""Faults that an emulated device shows on request: `KIND@START..END`, or `drop=SHARE`.

Times are seconds since its motors were first enabled, so that a fault happens at the same moment of
every flight.
"""

from __future__ import annotations

import math
import random
from dataclasses import dataclass

GRAMMAR = (
    "drop=SHARE (of the bytes, either way), stuck@START[..END] (the pitch encoder), "
    "jump=COUNTS@START, silent@START[..END] (neither sends nor hears), mute@START[..END] (hears only), "
    "reset@START, estop@START[..END], unplug@START..END; seconds since the motors were first enabled, "
    "for example --fault stuck@5..8"
)
KINDS = ("stuck", "jump", "silent", "mute", "reset", "estop", "unplug")


@dataclass(frozen=True, slots=True)
class Fault:
    """One fault of a kind, with its span."""

    kind: str
    start_s: float
    end_s: float
    amount: float = 0.0

    def active(self, time_s: float | None) -> bool:
        """Return whether it lasts at this time; None is before the motors were enabled."""
        return time_s is not None and self.start_s <= time_s < self.end_s


class Faults:
    """The faults of a text; ValueError, with the grammar, for an impossible one."""

    def __init__(self, texts: tuple[str, ...] = (), seed: int = 1) -> None:
        self.drop_share = 0.0
        self.faults: list[Fault] = []
        self._random = random.Random(seed)
        for text in texts:
            self._add(text)

    def active(self, kind: str, time_s: float | None) -> Fault | None:
        for fault in self.faults:
            if fault.kind == kind and fault.active(time_s):
                return fault
        return None

    def take_due(self, kind: str, time_s: float | None) -> Fault | None:
        """Return a fault that happens once and is due, and forget it."""
        for fault in self.faults:
            if fault.kind == kind and time_s is not None and time_s >= fault.start_s:
                self.faults.remove(fault)
                return fault
        return None

    def thin(self, data: bytes) -> bytes:
        """Lose the configured share of these bytes."""
        if not self.drop_share:
            return data
        return bytes(byte for byte in data if self._random.random() >= self.drop_share)

    def _add(self, text: str) -> None:
        name, at, span = text.partition("@")
        kind, _, amount_text = name.partition("=")
        try:
            amount = float(amount_text) if amount_text else 0.0
            if kind == "drop" and not at and 0.0 <= amount < 1.0:
                self.drop_share = amount
                return
            if kind not in KINDS or not at:
                raise ValueError
            start_text, dots, end_text = span.partition("..")
            start_s, end_s = float(start_text), float(end_text) if dots else math.inf
            if not 0.0 <= start_s < end_s:
                raise ValueError
        except ValueError:
            raise ValueError(f"fault {text!r} is none; expected {GRAMMAR}") from None
        self.faults.append(Fault(kind, start_s, end_s, amount))
