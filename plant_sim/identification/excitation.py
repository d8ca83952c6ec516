"""Exciting signals: the voltage difference mu over time, as a function of the tick.

The paper's is a square wave with a frequency, a bias and a magnitude; a pseudo-random binary sequence
excites a whole band evenly, and a chirp sweeps through one.

An experiment rests first, with both motors at the normal force alone, which gives theta_0; then mu
follows the signal. The rig is anything that gives an angle and takes voltages once per tick.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from scipy.signal import max_len_seq

from plant_sim.identification.errors import IdentificationError
from plant_sim.identification.record import Record

GRAMMAR = (
    "square:FREQUENCY,BIAS,MAGNITUDE or prbs:BIT_S,BIAS,MAGNITUDE or "
    "chirp:START,END,DURATION_S,MAGNITUDE (Hz, V), for example square:0.05,0.1,0.6"
)

Step = Callable[[int, float, float], float | None]
"""(tick, front volts, rear volts) -> angle measured before they act, rad; None when the rig ends."""
Signal = Callable[[int], float]
"""tick -> v_front - v_rear"""

REST_S = 5.0


def square_wave(step_s: float, frequency_hz: float, bias: float, magnitude: float) -> Signal:
    """Return bias plus or minus magnitude (V); the positive half comes first."""

    def volts(tick: int) -> float:
        half_periods = math.floor(2.0 * tick * step_s * frequency_hz + 1e-9)
        return bias + magnitude * (1.0 - 2.0 * (half_periods % 2))

    return volts


def pseudo_random(step_s: float, bit_s: float, bias: float, magnitude: float) -> Signal:
    """Return a maximum-length binary sequence (511 bits) around the bias, one value per `bit_s`."""
    ticks_per_bit = max(1, round(bit_s / step_s))
    bits = max_len_seq(9, taps=[4])[0].tolist()

    def volts(tick: int) -> float:
        return bias + magnitude * (2.0 * bits[tick // ticks_per_bit % len(bits)] - 1.0)

    return volts


def chirp(step_s: float, start_hz: float, end_hz: float, duration_s: float, magnitude: float) -> Signal:
    """Return a sine whose frequency rises evenly over the duration, then begins again."""
    rise = (end_hz - start_hz) / duration_s

    def volts(tick: int) -> float:
        time_s = tick * step_s % duration_s
        cycles = time_s * (start_hz + 0.5 * rise * time_s)
        return magnitude * math.sin(math.tau * cycles)

    return volts


KINDS: dict[str, tuple[Callable[..., Signal], int, int]] = {
    "square": (square_wave, 3, 1),
    "prbs": (pseudo_random, 3, 1),
    "chirp": (chirp, 4, 3),
}
"""signal, how many numbers it has, and how many of these, the first ones, must be above 0"""


def parse_excitation(text: str, step_s: float) -> Signal:
    """Return the signal that a command line names, as `GRAMMAR` says; IdentificationError."""
    kind, _, values = text.partition(":")
    try:
        numbers = [float(value) for value in values.split(",")]
    except ValueError:
        numbers = []
    signal, count, positive = KINDS.get(kind, (square_wave, 0, 0))
    if len(numbers) != count or not all(map(math.isfinite, numbers)) or not numbers:
        raise IdentificationError(f"excitation '{text}': expected {GRAMMAR}")
    if min(numbers[:positive]) <= 0.0:
        raise IdentificationError(f"excitation '{text}': frequencies and times must be above 0")
    if numbers[-1] == 0.0:
        raise IdentificationError(f"excitation '{text}': a magnitude of 0 V excites nothing")
    return signal(step_s, *numbers)


def excite(
    step: Step,
    signal: Signal,
    step_s: float,
    duration_s: float,
    *,
    normal_force_volts: float = 0.0,
) -> Record:
    """Return the record of the whole experiment of `duration_s`, the rest at its beginning included.

    The rest belongs to it: the state filters must have seen that the body was quiet before.
    """
    rest = round(REST_S / step_s)
    total = round(duration_s / step_s)
    if total <= rest:
        raise IdentificationError(
            f"an experiment of {duration_s:g} s is over before the rig is excited: it rests for "
            f"{REST_S:g} s first; make it longer (--duration), best by a minute"
        )
    rows = np.empty((total, 3))
    for tick in range(total):
        mu = signal(tick - rest) if tick >= rest else 0.0
        front, rear = 0.5 * (normal_force_volts + mu), 0.5 * (normal_force_volts - mu)
        angle = step(tick, front, rear)
        if angle is None:
            raise IdentificationError(f"the rig ended at tick {tick} of {total}")
        rows[tick] = angle, front, rear
    names = (("pitch",), ("front", "rear"), ("rad",), ("V", "V"))
    return Record(step_s, rows[:, :1], rows[:, 1:], *names)
