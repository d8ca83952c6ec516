"""The mapping of encoders to axes, and the conversion of motor voltages for a device."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from channel.codec.codec import Vector
from plant_sim.encoder import Encoder


@dataclass(frozen=True, slots=True)
class Axis:
    """One encoder channel of a device."""

    name: str
    channel: int
    counts_per_turn: int
    sign: int
    zero_counts: int | None
    """counts at 0 rad; None: those of the first sample"""

    def encoder(self, first_counts: tuple[int, ...]) -> Encoder:
        """Return the encoder, its zero fixed by the device's first sample where it is not given."""
        zero = first_counts[self.channel] if self.zero_counts is None else self.zero_counts
        return Encoder(self.counts_per_turn, self.sign, zero)

    def jump_counts(self, rate_max_rad_per_s: float, elapsed_s: float) -> float:
        """Return the most counts that the axis can turn in this time, with a few to spare."""
        return 4.0 + self.counts_per_turn / math.tau * rate_max_rad_per_s * elapsed_s


VoltsUnit = Literal["motor_volts", "dac_volts"]


@dataclass(frozen=True, slots=True)
class Motors:
    """How the two commands (front, rear; in motor volts) reach the device's outputs.

    A lab's "5 V" may be at the motor or at the analogue output before its amplifier. `unit` says
    which of them the device takes; motor volts are divided by `amplifier_gain` for the latter.
    """

    unit: VoltsUnit = "motor_volts"
    amplifier_gain: float = 1.0
    channels: tuple[int, int] = (0, 1)
    """output of the front motor, of the rear motor"""
    signs: tuple[int, int] = (1, 1)
    device_volts_max: float = 10.0
    """what the device's output can give, in its own unit"""

    def to_device(self, volts: Vector) -> tuple[float, ...]:
        """Return one value per output, channel 0 first."""
        gain = self.amplifier_gain if self.unit == "dac_volts" else 1.0
        limit = self.device_volts_max
        outputs = [0.0] * (max(self.channels) + 1)
        for channel, sign, value in zip(self.channels, self.signs, volts, strict=True):
            outputs[channel] = min(max(sign * value / gain, -limit), limit)
        return tuple(outputs)

    def off(self) -> tuple[float, ...]:
        """Return zero for every output."""
        return (0.0,) * (max(self.channels) + 1)
