"""Limits of a motor command and its form on the wire.

The receiver limits and rounds a command before it is sent; both codecs use the value decoded from
the wire, so they hold the same number. The guard beside the motors applies the same limits once
more and normally changes nothing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from channel.codec.codec import Vector

VOLTS_MAX = 32.0
"""Largest voltage that 16-bit millivolts carry with room to spare."""

PLAUSIBLE_VOLTS_MAX = 1e6
"""A law that wants more has lost its way; anything less is only clamped."""


@dataclass(frozen=True, slots=True)
class CommandLimits:
    """Clamp and slew of each motor voltage."""

    volts_max: float = 5.0
    slew_volts_per_tick: float = math.inf

    def __post_init__(self) -> None:
        if not 0.0 < self.volts_max <= VOLTS_MAX:
            raise ValueError(f"volts_max must be in (0, {VOLTS_MAX}], got {self.volts_max}")
        if not self.slew_volts_per_tick > 0.0:
            raise ValueError(f"the slew limit must be positive, got {self.slew_volts_per_tick}")

    def apply(self, volts: Sequence[float], previous: Vector) -> Vector:
        """Return the voltages clamped, then moved at most one slew step away from `previous`."""
        largest = self.volts_max
        step = self.slew_volts_per_tick
        if len(volts) == 2 and len(previous) == 2:
            # Twice a tick in every flight: written out, it takes half the time.
            return (
                limited(volts[0], previous[0], largest, step),
                limited(volts[1], previous[1], largest, step),
            )
        return tuple(
            [
                limited(wanted, before, largest, step)
                for wanted, before in zip(volts, previous, strict=True)
            ]
        )


def limited(wanted: float, before: float, largest: float, step: float) -> float:
    """Return one voltage within +-`largest`, at most `step` away from the one `before`."""
    value = wanted
    if value > largest:
        value = largest
    elif value < -largest:
        value = -largest
    if value > before + step:
        value = before + step
    elif value < before - step:
        value = before - step
    return value


def as_carried(volts: float) -> float:
    """Return one voltage as the wire rounds it: `from_millivolts` of `to_millivolts`."""
    return round(1000.0 * volts) / 1000.0


def are_plausible(volts: Sequence[float]) -> bool:
    """Return whether every voltage is a number, and not an absurd one."""
    # A loop: this runs at every tick, and `all` costs three times as much.
    for value in volts:  # noqa: SIM110
        if not -PLAUSIBLE_VOLTS_MAX < value < PLAUSIBLE_VOLTS_MAX:
            return False
    return True


def to_millivolts(volts: Sequence[float]) -> tuple[int, ...]:
    """Round voltages to the whole millivolts that a frame carries."""
    return tuple([round(1000.0 * value) for value in volts])


def from_millivolts(millivolts: Sequence[int]) -> Vector:
    """Return the voltages that both codecs use for a command of the wire."""
    return tuple([value / 1000.0 for value in millivolts])
