"""Simulated impairments of a line: given by a text, seeded, reproducible.

    loss=0.2              every message is lost with this probability (also 20%)
    burst=0.02/0.25       Gilbert-Elliott: chance per message to enter and leave a state that loses all
    flip=0.01             a symbol arrives whole, but as another symbol
    raw=0.01              one bit of the message is inverted; its check then drops it
    duplicate=0.1         a message arrives twice
    reorder=0.1/150ms     a message is held back by up to this time (150ms if not given)
    delay=30ms±10ms       every message takes this long, evenly spread by the second number (also +-)
    cut=10s+2s            nothing passes for 2 s from flight time 10 s on; may be given repeatedly
    dead=30s              nothing passes from 30 s on
    skew=200ppm           the receiver's clock runs fast (slow: -200ppm)
    step=50ms@10s         the receiver's clock jumps at 10 s; may be given repeatedly

Items are separated by commas. `up:` or `down:` before an item keeps it to one direction. Each direction
has chances of its own. On the narrow downlink every symbol is a message, as on the uplink. The other
downlinks carry command frames, and `flip` then acts on the uplink only.
"""

from __future__ import annotations

import math
import random
import re
from collections import Counter
from dataclasses import dataclass, field, replace
from typing import Any, Literal

from channel.codec.codec import Alphabet
from channel.line.line import CleanLine, Delivery, Line
from channel.protocol.wire import DATAGRAM, SymbolWire

Direction = Literal["up", "down"]
FOR_EVER_NS = 2**62
REORDER_NS = 150_000_000

_UNITS_NS = {"s": 1e9, "ms": 1e6, "us": 1e3}
_TIME = re.compile(r"(\d+(?:\.\d*)?)(us|ms|s)")


@dataclass(frozen=True, slots=True)
class Impairments:
    """The impairments of one direction. Probabilities are per message."""

    loss: float = 0.0
    burst_enter: float = 0.0
    burst_leave: float = 1.0
    flip: float = 0.0
    raw: float = 0.0
    duplicate: float = 0.0
    reorder: float = 0.0
    reorder_ns: int = REORDER_NS
    delay_ns: int = 0
    jitter_ns: int = 0
    cuts: tuple[tuple[int, int], ...] = ()
    """(start, end) in flight time, ns"""

    @property
    def any(self) -> bool:
        return self != Impairments()

    @property
    def random(self) -> bool:
        """Return whether another seed may have another effect."""
        bursts = self.burst_enter > 0.0 and min(self.burst_enter, self.burst_leave) < 1.0
        moved = self.jitter_ns or self.flip or self.duplicate or self.reorder
        return bursts or bool(moved) or any(0.0 < one < 1.0 for one in (self.loss, self.raw))

    def is_cut(self, now_ns: int) -> bool:
        """Return whether nothing passes at a flight time."""
        return any(start <= now_ns < end for start, end in self.cuts)


@dataclass(frozen=True, slots=True)
class LineFaults:
    """Both directions, and the receiver's clock."""

    up: Impairments = Impairments()
    down: Impairments = Impairments()
    skew_ppm: float = 0.0
    clock_steps: tuple[tuple[int, int], ...] = ()
    """(flight time, jump), ns"""

    @property
    def any(self) -> bool:
        return self != LineFaults()

    @property
    def bad_clock(self) -> bool:
        """Return whether the receiver's clock shows another time than the transmitter's."""
        return bool(self.skew_ppm or self.clock_steps)

    @property
    def longest_delay_ns(self) -> int:
        """Return the longest usual delay of a symbol up and its command down, together."""
        return sum(one.delay_ns + one.jitter_ns for one in (self.up, self.down))


def parse_impairments(text: str) -> LineFaults:
    """Return the impairments of a text; ValueError, naming the item, for an invalid one."""
    faults = LineFaults()
    for item in filter(None, (part.strip() for part in text.split(","))):
        try:
            faults = _with_item(faults, item)
        except ValueError as error:
            raise ValueError(f"impairment {item!r}: {error}") from None
    return faults


def _with_item(faults: LineFaults, item: str) -> LineFaults:
    prefix, colon, rest = item.partition(":")
    if colon and prefix not in ("up", "down"):
        raise ValueError("only up: and down: may stand before an item")
    name, equals, value = (rest if colon else item).partition("=")
    if not equals:
        raise ValueError("write NAME=VALUE")
    if name == "skew":
        skew_ppm = _number(value.removesuffix("ppm"))
        if skew_ppm <= -1e6:
            raise ValueError("such a clock would stand still or run backwards")
        return replace(faults, skew_ppm=skew_ppm)
    if name == "step":
        jump, _, start = value.partition("@")
        step = (_time_ns(start), _time_ns(jump.removeprefix("-")) * (-1 if jump[:1] == "-" else 1))
        return replace(faults, clock_steps=tuple(sorted((*faults.clock_steps, step))))
    changed = faults
    if prefix != "down" or not colon:
        changed = replace(changed, up=_with_value(faults.up, name, value))
    if prefix != "up" or not colon:
        changed = replace(changed, down=_with_value(faults.down, name, value))
    return changed


def _with_value(one: Impairments, name: str, value: str) -> Impairments:
    first, _, second = value.partition("/")
    match name:
        case "loss" | "flip" | "raw" | "duplicate":
            chance: dict[str, Any] = {name: _probability(value)}
            return replace(one, **chance)
        case "burst":
            enter, leave = _probability(first), _probability(second)
            if leave == 0.0:
                raise ValueError("a burst must be left some time")
            return replace(one, burst_enter=enter, burst_leave=leave)
        case "reorder":
            held_ns = _time_ns(second) if second else REORDER_NS
            return replace(one, reorder=_probability(first), reorder_ns=held_ns)
        case "delay":
            mean, _, spread = value.replace("+-", "±").partition("±")
            jitter_ns = _time_ns(spread) if spread else 0
            if jitter_ns > _time_ns(mean):
                raise ValueError("the spread is larger than the delay itself")
            return replace(one, delay_ns=_time_ns(mean), jitter_ns=jitter_ns)
        case "cut":
            start, plus, length = value.partition("+")
            if not plus:
                raise ValueError("write cut=START+LENGTH, such as cut=10s+2s")
            cut = (_time_ns(start), _time_ns(start) + _time_ns(length))
            return replace(one, cuts=(*one.cuts, cut))
        case "dead":
            return replace(one, cuts=(*one.cuts, (_time_ns(value), FOR_EVER_NS)))
    raise ValueError(
        "no such impairment; there are loss, burst, flip, raw, duplicate, reorder, delay, cut, dead, "
        "skew and step"
    )


def _probability(text: str) -> float:
    percent = text.endswith("%")
    value = _number(text.removesuffix("%")) / (100.0 if percent else 1.0)
    if not 0.0 <= value <= 1.0:
        raise ValueError(f"{text} is not between 0 and 1")
    return value


def _number(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise ValueError(f"{text!r} is no number")
    return value


def _time_ns(text: str) -> int:
    match = _TIME.fullmatch(text)
    if match is None:
        raise ValueError(f"{text!r} is no time from 0 on; write 30ms, 1.5s or 200us")
    return round(float(match[1]) * _UNITS_NS[match[2]])


@dataclass(slots=True)
class ImpairedLine:
    """A line with impairments before it; `counts` has the number of messages of each kind."""

    impairments: Impairments
    alphabet: Alphabet
    seed: str
    wire: SymbolWire = DATAGRAM
    line: Line = field(default_factory=CleanLine)
    counts: Counter[str] = field(default_factory=Counter)
    _chance: random.Random = field(init=False)
    _in_burst: bool = field(init=False, default=False)

    def __post_init__(self) -> None:
        self._chance = random.Random(self.seed)

    @property
    def longest_delay_ns(self) -> int:
        one = self.impairments
        held_ns = one.reorder_ns if one.reorder or one.duplicate else 0
        return self.line.longest_delay_ns + one.delay_ns + one.jitter_ns + held_ns

    def suffer(self, impairments: Impairments) -> None:
        """Change the impairments from now on."""
        self.impairments = impairments

    def carry(self, data: bytes, now_ns: int) -> list[Delivery]:
        one, chance = self.impairments, self._chance.random
        enters_ns = now_ns + one.delay_ns
        if one.jitter_ns:
            enters_ns += round((2.0 * chance() - 1.0) * one.jitter_ns)
        if self._is_lost(now_ns):
            return [Delivery(arrival_ns, None) for arrival_ns, _ in self.line.carry(data, enters_ns)]
        if one.reorder and chance() < one.reorder:
            self.counts["reordered"] += 1
            enters_ns += round(chance() * one.reorder_ns)
        if one.flip and self.wire.is_symbol(data) and chance() < one.flip:
            data = self._flipped(data)
        if one.raw and chance() < one.raw:
            self.counts["corrupted"] += 1
            bit = self._chance.randrange(8 * len(data))
            byte = data[bit >> 3] ^ (1 << (bit & 7))
            data = data[: bit >> 3] + bytes((byte,)) + data[(bit >> 3) + 1 :]
        deliveries = self.line.carry(data, enters_ns)
        if one.duplicate and chance() < one.duplicate:
            self.counts["duplicated"] += 1
            deliveries += self.line.carry(data, enters_ns + round(chance() * one.reorder_ns))
        return deliveries

    def _is_lost(self, now_ns: int) -> bool:
        one, chance = self.impairments, self._chance.random
        if one.cuts and one.is_cut(now_ns):
            self.counts["cut off"] += 1
            return True
        if one.burst_enter:
            self._in_burst = (
                chance() >= one.burst_leave if self._in_burst else chance() < one.burst_enter
            )
            if self._in_burst:
                self.counts["lost in bursts"] += 1
                return True
        if one.loss and chance() < one.loss:
            self.counts["lost"] += 1
            return True
        return False

    def _flipped(self, data: bytes) -> bytes:
        """Return the message of a symbol with another symbol in it, whole."""
        self.counts["flipped"] += 1
        kinds = len(self.alphabet.symbols)
        return self.wire.renumbered(data, 1 + self._chance.randrange(kinds - 1), kinds)


def impair(line: Line, impairments: Impairments) -> bool:
    """Change the impairments of a line from now on; return whether it can be impaired."""
    if not isinstance(line, ImpairedLine):
        return False
    line.suffer(impairments)
    return True
