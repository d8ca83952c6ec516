"""Exciting signals: the voltage difference mu over time, as a function of the tick.

The paper's is a square wave with a frequency, a bias and a magnitude; a pseudo-random binary sequence
excites a whole band evenly, and a chirp sweeps through one.

An experiment rests first, with both motors at the normal force alone, which gives theta_0; then mu
follows the signal. The rig is anything that gives an angle and takes voltages once per tick.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from plant_sim.identification.errors import IdentificationError
from plant_sim.identification.record import Record

GRAMMAR = (
    "square:FREQUENCY,BIAS,MAGNITUDE or prbs:BIT_S,BIAS,MAGNITUDE or "
    "chirp:START,END,DURATION_S,MAGNITUDE (Hz, V), for example square:0.05,0.1,0.6"
)

_TAPS = {7: 6, 9: 5, 11: 9, 15: 14}
"""Register length and the second tap that makes its sequence as long as possible."""

Step = Callable[[int, float, float], float | None]
"""(tick, front volts, rear volts) -> angle measured before they act, rad; None when the rig ends."""

REST_S = 5.0


class ExcitingSignal(Protocol):
    """A voltage difference for every tick."""

    def volts(self, tick: int) -> float:
        """Return v_front - v_rear of this tick."""
        ...


@dataclass(frozen=True, slots=True)
class SquareWave:
    """Bias plus or minus magnitude; the positive half comes first."""

    step_s: float
    frequency_hz: float
    bias_volts: float
    magnitude_volts: float

    def volts(self, tick: int) -> float:
        """Return v_front - v_rear of this tick."""
        half_periods = math.floor(2.0 * tick * self.step_s * self.frequency_hz + 1e-9)
        return self.bias_volts + self.magnitude_volts * (1.0 - 2.0 * (half_periods % 2))


class PseudoRandom:
    """A maximum-length binary sequence around the bias, one value per `bit_s`."""

    def __init__(
        self, step_s: float, bit_s: float, bias_volts: float, magnitude_volts: float, length: int = 9
    ) -> None:
        if length not in _TAPS:
            raise IdentificationError(f"length is {length}; known: {sorted(_TAPS)}")
        self._ticks_per_bit = max(1, round(bit_s / step_s))
        self._bias = bias_volts
        self._magnitude = magnitude_volts
        register = (1 << length) - 1
        bits = []
        for _ in range((1 << length) - 1):
            bits.append(register & 1)
            new = (register ^ (register >> (length - _TAPS[length]))) & 1
            register = register >> 1 | new << (length - 1)
        self.bits = tuple(bits)

    def volts(self, tick: int) -> float:
        """Return v_front - v_rear of this tick."""
        bit = self.bits[tick // self._ticks_per_bit % len(self.bits)]
        return self._bias + self._magnitude * (2.0 * bit - 1.0)


@dataclass(frozen=True, slots=True)
class Chirp:
    """A sine whose frequency rises evenly over the duration, then begins again."""

    step_s: float
    start_hz: float
    end_hz: float
    duration_s: float
    magnitude_volts: float

    def volts(self, tick: int) -> float:
        """Return v_front - v_rear of this tick."""
        time_s = tick * self.step_s % self.duration_s
        rise = (self.end_hz - self.start_hz) / self.duration_s
        cycles = time_s * (self.start_hz + 0.5 * rise * time_s)
        return self.magnitude_volts * math.sin(math.tau * cycles)


def parse_excitation(text: str, step_s: float) -> ExcitingSignal:
    """Return the signal that a command line names, as `GRAMMAR` says; IdentificationError."""
    kind, _, values = text.partition(":")
    counts = {"square": 3, "prbs": 3, "chirp": 4}
    try:
        numbers = [float(value) for value in values.split(",")]
    except ValueError:
        numbers = []
    if kind not in counts or len(numbers) != counts[kind] or not all(map(math.isfinite, numbers)):
        raise IdentificationError(f"excitation '{text}': expected {GRAMMAR}")
    positive = numbers[:1] if kind != "chirp" else numbers[:3]
    if min(positive) <= 0.0:
        raise IdentificationError(f"excitation '{text}': frequencies and times must be above 0")
    if numbers[-1] == 0.0:
        raise IdentificationError(f"excitation '{text}': a magnitude of 0 V excites nothing")
    if kind == "square":
        return SquareWave(step_s, *numbers)
    if kind == "prbs":
        return PseudoRandom(step_s, numbers[0], numbers[1], numbers[2])
    return Chirp(step_s, *numbers)


def excite(
    step: Step,
    signal: ExcitingSignal,
    step_s: float,
    duration_s: float,
    *,
    rest_s: float = REST_S,
    normal_force_volts: float = 0.0,
) -> Record:
    """Return the record of the whole experiment of `duration_s`, the rest at its beginning included.

    The rest belongs to it: the state filters must have seen that the body was quiet before.
    """
    rest = round(rest_s / step_s)
    total = round(duration_s / step_s)
    if total <= rest:
        raise IdentificationError(
            f"an experiment of {duration_s:g} s is over before the rig is excited: it rests for "
            f"{rest_s:g} s first; make it longer (--duration), best by a minute"
        )
    rows = np.empty((total, 3))
    for tick in range(total):
        mu = signal.volts(tick - rest) if tick >= rest else 0.0
        front, rear = 0.5 * (normal_force_volts + mu), 0.5 * (normal_force_volts - mu)
        angle = step(tick, front, rear)
        if angle is None:
            raise IdentificationError(f"the rig ended at tick {tick} of {total}")
        rows[tick] = angle, front, rear
    return Record(
        step_s,
        rows[:, :1],
        rows[:, 1:],
        ("pitch",),
        ("front", "rear"),
        ("rad",),
        ("V", "V"),
    )
