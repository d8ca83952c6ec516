"""Faults of records, found before identification: units, wraps, constant signals."""

from __future__ import annotations

import math

import numpy as np
from scipy.signal import detrend, welch

from plant_sim.identification.errors import IdentificationError
from plant_sim.identification.record import Record
from plant_sim.identification.structures import PitchStructure, Structure

VOLTS_MAX = 60.0
COUNTS = (360, 400, 500, 512, 720, 1000, 1440, 2000, 2500, 3600, 4000, 5000, 8000, 10_000, 20_000)
"""Counts per turn of usual encoders, beside the powers of two."""
SPECTRUM_SAMPLES = 65_536


def require_motion(record: Record) -> None:
    """Raise IdentificationError for a record without inputs, or with a signal that never changes."""
    if not record.inputs.shape[1]:
        raise IdentificationError(
            "the record has no input, so nothing can be said about what moves the plant: name the "
            "columns of what was commanded"
        )
    still = np.ptp(record.outputs, axis=0) == 0.0
    if np.any(still):
        name = record.output_names[int(np.argmax(still))]
        raise IdentificationError(
            f"the {name} never changes: the encoder is not connected, or the column is a wrong one"
        )


def require_units(record: Record) -> list[str]:
    """Raise IdentificationError where angles are in another unit; return doubts about voltages."""
    for name, unit, step in zip(record.output_names, record.output_units, record.steps, strict=True):
        if unit == "rad" and step and _counts(360.0 / step):
            raise IdentificationError(
                f"the {name} moves in steps of {step:.6g} = 360/{round(360.0 / step)}: the column is "
                "in degrees and is read as rad, a factor of 57.3. Say --units deg"
            )
        if unit == "deg" and step and _counts(math.tau / step):
            raise IdentificationError(
                f"the {name} moves in steps of {step:.6g} = 2 pi/{round(math.tau / step)}: the column "
                "is in rad and is read as degrees, a factor of 57.3. Say --units rad"
            )
    largest = np.abs(record.inputs).max(axis=0, initial=0.0).tolist()
    return [
        f"{name} reaches {most:.4g} V: is the column in millivolts (a factor of 1000) or in counts? "
        f"Say --units {name}=mV, --scale {name}=FACTOR, or --units {name}=V where it is right"
        for name, unit, most in zip(record.input_names, record.input_units, largest, strict=True)
        if unit == "V" and most > VOLTS_MAX
    ]


def _counts(value: float) -> bool:
    """Return whether a number is that of a usual encoder's counts per turn."""
    whole = round(value)
    usual = whole in COUNTS or (whole >= 64 and whole & (whole - 1) == 0)
    return usual and abs(value - whole) < 2e-3 * whole


def dominant_rad_s(record: Record, structure: Structure) -> float:
    """Return the frequency at which the outputs move most, by their spectrum.

    Of an angle that turns over it is that of its sine, which the turns do not drown.
    """
    length = min(len(record), SPECTRUM_SAMPLES)
    found = np.zeros(length // 2 + 1)
    outputs = record.outputs
    if isinstance(structure, PitchStructure) and float(np.ptp(outputs)) > math.pi:
        outputs = np.sin(outputs)
    for values in outputs.T:
        frequencies, power = welch(detrend(values), 1.0 / record.step_s, nperseg=length)
        found += frequencies * power / max(float(np.var(values)), 1e-300)
    # A decade has the more power the wider it is: times the frequency, the peak is of the motion.
    spread = max(1, length // 2048)
    smooth = np.convolve(found, np.ones(spread) / spread, "same")
    return math.tau * float(frequencies[max(1, int(np.argmax(smooth)))])
