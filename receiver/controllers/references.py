"""Set-points of an output, one for every control tick, in the unit of the output.

Switching times are turned into ticks once, so that a square wave of 25 s switches at tick 1250
exactly, however 12.5 / 0.01 happens to round.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Protocol

from channel.protocol.limits import limited

# A time within this share of a tick after the tick counts as the tick itself.
_TICK_TOLERANCE: Final = 1e-6


class Reference(Protocol):
    """A set-point to follow."""

    def value(self, tick: int) -> float:
        """Return the set-point at `tick` (0 is the start of the run)."""
        ...


@dataclass(frozen=True, slots=True)
class Constant:
    """One value for ever."""

    level: float
    tick_s: float

    def __post_init__(self) -> None:
        _require_finite("level", self.level)
        _require_positive("tick_s", self.tick_s)

    def value(self, tick: int) -> float:
        return self.level


@dataclass(frozen=True, slots=True)
class Shifted:
    """A set-point about another level than 0."""

    about: Reference
    offset: float

    def __post_init__(self) -> None:
        _require_finite("offset", self.offset)

    def value(self, tick: int) -> float:
        return self.offset + self.about.value(tick)


@dataclass(frozen=True, slots=True)
class Step:
    """0 until `start_s` (at least 0), `amplitude` from there on."""

    amplitude: float
    start_s: float
    tick_s: float

    def __post_init__(self) -> None:
        _require_finite("amplitude", self.amplitude)
        _require_positive("tick_s", self.tick_s)
        if not (math.isfinite(self.start_s) and self.start_s >= 0.0):
            raise ValueError(f"start_s is {self.start_s}; it must be finite and at least 0")

    def value(self, tick: int) -> float:
        return self.amplitude if tick >= _first_tick(self.start_s, self.tick_s) else 0.0


@dataclass(frozen=True, slots=True)
class _Wave:
    """What repeats every `period_s`, which is at least two ticks."""

    amplitude: float
    period_s: float
    tick_s: float

    def __post_init__(self) -> None:
        _require_finite("amplitude", self.amplitude)
        _require_positive("tick_s", self.tick_s)
        least_s = 2.0 * self.tick_s
        if not (math.isfinite(self.period_s) and self.period_s >= least_s):
            raise ValueError(f"period_s is {self.period_s}; it must be finite and at least {least_s}")


class Square(_Wave):
    """A square wave between +`amplitude`, where it starts, and -`amplitude`.

    The defaults of the paper are pi/2 and 25 s.
    """

    def value(self, tick: int) -> float:
        half_periods = tick * self.tick_s / (0.5 * self.period_s)
        tolerance = _TICK_TOLERANCE * self.tick_s / self.period_s
        odd = math.floor(half_periods + tolerance) % 2
        return -self.amplitude if odd else self.amplitude


class Sine(_Wave):
    """A sine of `amplitude` that starts at 0 and rises."""

    def value(self, tick: int) -> float:
        return self.amplitude * math.sin(math.tau * tick * self.tick_s / self.period_s)


class Listed:
    """Values at times of their own, which rise and are at least 0; each holds until the next.

    Before the first time its value holds, after the last one the last. ValueError for other times.
    """

    def __init__(self, times_s: Sequence[float], values: Sequence[float], tick_s: float) -> None:
        _require_positive("tick_s", tick_s)
        for before, time_s in zip((-1.0, *times_s), times_s, strict=False):
            if not before < time_s or time_s < 0.0:
                raise ValueError(f"a time is {time_s} s; times are at least 0 and rise")
        self._first_ticks = [_first_tick(time_s, tick_s) for time_s in times_s]
        self.values = list(values)

    def value(self, tick: int) -> float:
        return self.values[max(bisect_right(self._first_ticks, tick) - 1, 0)]


class LimitedReference:
    """A set-point that keeps within +-`largest` and moves by at most `step` a tick, from `start` on.

    Ticks are asked for in order; of earlier ones the last `kept` values are known.
    """

    KEPT = 4096

    def __init__(
        self, programme: Reference, start: float, largest: float, step: float, kept: int = KEPT
    ) -> None:
        self._by_hand: float | None = None
        self.largest = largest
        self._programme, self._step = programme, step
        self._tick = -1
        self._kept = deque([start], kept)

    def begin(self, tick: int, start: float) -> None:
        """Move from `start` at this tick, whatever came before it."""
        self._tick = tick - 1
        self._kept = deque([start], self._kept.maxlen)

    def value(self, tick: int) -> float:
        while self._tick < tick:
            self._tick += 1
            by_hand = self._by_hand
            wanted = self._programme.value(self._tick) if by_hand is None else by_hand
            self._kept.append(limited(wanted, self._kept[-1], self.largest, self._step))
        return self._kept[max(tick - self._tick - 1, -len(self._kept))]

    def steer(self, value: float | None) -> None:
        """Take this in place of the programme, within the same limits; None: the programme again."""
        self._by_hand = value


class SteeredReference:
    """A set-point that is the configured one until a person takes it over in flight.

    To be steered between two samples only: every tick of a sample then sees the same hand.
    """

    def __init__(
        self, programme: Reference, stops: tuple[float, float] = (-math.inf, math.inf)
    ) -> None:
        self._programme = programme
        largest = programme.largest if isinstance(programme, LimitedReference) else math.inf
        self.stops = max(stops[0], -largest), min(stops[1], largest)
        """least and largest set-point that the plant can reach"""
        self.by_hand: float | None = None
        """the set-point given by hand; None: the configured reference is followed"""

    def steer(self, value: float | None) -> None:
        """Take the set-point by hand; None gives it back to the configured reference."""
        self.by_hand = value
        if isinstance(self._programme, LimitedReference):
            self._programme.steer(value)

    def begin(self, tick: int, start: float) -> None:
        """Move from `start` at this tick, where the set-point has limits."""
        if isinstance(self._programme, LimitedReference):
            self._programme.begin(tick, start)

    def value(self, tick: int) -> float:
        if self.by_hand is None or isinstance(self._programme, LimitedReference):
            return self._programme.value(tick)
        return self.by_hand


def _first_tick(time_s: float, tick_s: float) -> int:
    return math.ceil(time_s / tick_s - _TICK_TOLERANCE)


def _require_finite(name: str, value: float) -> None:
    if not math.isfinite(value):
        raise ValueError(f"{name} is {value}; it must be finite")


def _require_positive(name: str, value: float) -> None:
    if not (math.isfinite(value) and value > 0.0):
        raise ValueError(f"{name} is {value}; it must be finite and above 0")
