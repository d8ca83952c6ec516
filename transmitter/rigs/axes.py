"""The mapping of encoders to axes, and the conversion of commands for a device."""

from __future__ import annotations

import math
from dataclasses import dataclass

from channel.codec.codec import Vector
from plant_sim.encoder import Encoder


@dataclass(frozen=True, slots=True)
class Axis:
    """One encoder channel of a device."""

    name: str
    channel: int
    counts_per_turn: float
    sign: int
    zero_counts: int | None
    """counts at 0; None: those of the first sample"""
    turn: float = math.tau
    """the value of `counts_per_turn` counts, see `Encoder`"""

    def encoder(self, first_counts: tuple[int, ...]) -> Encoder:
        """Return the encoder, its zero fixed by the device's first sample where it is not given."""
        zero = first_counts[self.channel] if self.zero_counts is None else self.zero_counts
        return Encoder(self.counts_per_turn, self.sign, zero, self.turn)

    def jump_counts(self, rate_max_rad_per_s: float, elapsed_s: float) -> float:
        """Return the most counts that the axis can turn in this time, with a few to spare."""
        return 4.0 + self.counts_per_turn / self.turn * rate_max_rad_per_s * elapsed_s


@dataclass(frozen=True, slots=True)
class Motors:
    """How the inputs of the plant reach the device's outputs.

    A lab's "5 V" may be at the motor or at the analogue output before its amplifier: `gains` say how
    many units of each input are one of the device's.
    """

    gains: tuple[float, ...] = (1.0, 1.0)
    channels: tuple[int, ...] = (0, 1)
    """output of each input"""
    signs: tuple[int, ...] = (1, 1)
    device_max: float = 10.0
    """what the device's output can give, in its own unit"""
    outputs: int = 2
    """that the device is sent, those that no input is on included"""

    def to_device(self, command: Vector) -> tuple[float, ...]:
        """Return one value per output, channel 0 first."""
        limit = self.device_max
        outputs = list(self.off())
        wired = zip(self.channels, self.signs, self.gains, command, strict=True)
        for channel, sign, gain, value in wired:
            outputs[channel] = min(max(sign * value / gain, -limit), limit)
        return tuple(outputs)

    def off(self) -> tuple[float, ...]:
        return (0.0,) * max(self.outputs, max(self.channels) + 1)
