"""Reference angles, one for every control tick.

Switching times are turned into ticks once, so that a square wave of 25 s switches at tick 1250
exactly, however 12.5 / 0.01 happens to round.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from dataclasses import dataclass
from os import PathLike
from typing import Final, Protocol

from channel.flight_log import parse_number, read_columns

# A time within this share of a tick after the tick counts as the tick itself.
_TICK_TOLERANCE: Final = 1e-6


class Reference(Protocol):
    """An angle to follow."""

    def angle_rad(self, tick: int) -> float:
        """Return the reference angle (rad) at `tick` (0 is the start of the run)."""
        ...


@dataclass(frozen=True, slots=True)
class Constant:
    """One angle for ever."""

    level_rad: float
    tick_s: float

    def __post_init__(self) -> None:
        """Refuse values out of range."""
        _require_finite("level_rad", self.level_rad)
        _require_positive("tick_s", self.tick_s)

    def angle_rad(self, tick: int) -> float:
        """Return the level."""
        return self.level_rad


@dataclass(frozen=True, slots=True)
class Step:
    """0 rad until `start_s` (at least 0), `amplitude_rad` from there on."""

    amplitude_rad: float
    start_s: float
    tick_s: float

    def __post_init__(self) -> None:
        """Refuse values out of range."""
        _require_finite("amplitude_rad", self.amplitude_rad)
        _require_positive("tick_s", self.tick_s)
        if not (math.isfinite(self.start_s) and self.start_s >= 0.0):
            raise ValueError(f"start_s is {self.start_s}; it must be finite and at least 0")

    def angle_rad(self, tick: int) -> float:
        """Return the reference angle (rad) at `tick`."""
        return self.amplitude_rad if tick >= _first_tick(self.start_s, self.tick_s) else 0.0


@dataclass(frozen=True, slots=True)
class Square:
    """A square wave between +`amplitude_rad`, where it starts, and -`amplitude_rad`.

    `period_s` is at least two ticks. The defaults of the paper are pi/2 and 25 s.
    """

    amplitude_rad: float
    period_s: float
    tick_s: float

    def __post_init__(self) -> None:
        """Refuse values out of range."""
        _require_wave(self.amplitude_rad, self.period_s, self.tick_s)

    def angle_rad(self, tick: int) -> float:
        """Return the reference angle (rad) at `tick`."""
        half_periods = tick * self.tick_s / (0.5 * self.period_s)
        tolerance = _TICK_TOLERANCE * self.tick_s / self.period_s
        odd = math.floor(half_periods + tolerance) % 2
        return -self.amplitude_rad if odd else self.amplitude_rad


@dataclass(frozen=True, slots=True)
class Sine:
    """A sine of `amplitude_rad` that starts at 0 and rises; `period_s` is at least two ticks."""

    amplitude_rad: float
    period_s: float
    tick_s: float

    def __post_init__(self) -> None:
        """Refuse values out of range."""
        _require_wave(self.amplitude_rad, self.period_s, self.tick_s)

    def angle_rad(self, tick: int) -> float:
        """Return the reference angle (rad) at `tick`."""
        return self.amplitude_rad * math.sin(math.tau * tick * self.tick_s / self.period_s)


class Csv:
    """Angles from a file with the columns `time_s` and `angle_rad`; each row holds until the next.

    Times rise from row to row and are at least 0. Before the first row its angle holds, after the
    last one the last.
    """

    def __init__(self, path: str | PathLike[str], tick_s: float) -> None:
        """Read the whole file; ValueError with file and line for anything wrong in it."""
        _require_positive("tick_s", tick_s)
        self._first_ticks: list[int] = []
        self._angles_rad: list[float] = []
        last_time_s = -math.inf
        for line, (time_text, angle_text) in read_columns(path, ("time_s", "angle_rad")):
            time_s = parse_number(time_text, path, line, "time_s")
            if time_s < 0.0 or time_s <= last_time_s:
                floor = "at least 0" if last_time_s < 0.0 else f"above {last_time_s}"
                raise ValueError(
                    f"{path}, line {line}, column time_s: {time_s} found; it must be {floor}"
                )
            last_time_s = time_s
            self._first_ticks.append(_first_tick(time_s, tick_s))
            self._angles_rad.append(parse_number(angle_text, path, line, "angle_rad"))
        if not self._angles_rad:
            raise ValueError(f"{path}, line 2: no rows; a reference needs at least 1")

    def angle_rad(self, tick: int) -> float:
        """Return the reference angle (rad) at `tick`."""
        return self._angles_rad[max(bisect_right(self._first_ticks, tick) - 1, 0)]


def _first_tick(time_s: float, tick_s: float) -> int:
    return math.ceil(time_s / tick_s - _TICK_TOLERANCE)


def _require_finite(name: str, value: float) -> None:
    if not math.isfinite(value):
        raise ValueError(f"{name} is {value}; it must be finite")


def _require_positive(name: str, value: float) -> None:
    if not (math.isfinite(value) and value > 0.0):
        raise ValueError(f"{name} is {value}; it must be finite and above 0")


def _require_wave(amplitude_rad: float, period_s: float, tick_s: float) -> None:
    _require_finite("amplitude_rad", amplitude_rad)
    _require_positive("tick_s", tick_s)
    if not (math.isfinite(period_s) and period_s >= 2.0 * tick_s):
        raise ValueError(f"period_s is {period_s}; it must be finite and at least {2.0 * tick_s}")
