"""A recorded stretch of pitch motion, checked, and the identification over it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from plant_sim.identification.errors import IdentificationError
from plant_sim.identification.estimator import Array
from plant_sim.identification.pitch import PitchEstimates, PitchIdentifier, PitchSettings

ANGLE_MAX_RAD = 2.0 * math.pi
"""A helicopter that pitches further has turned over; numbers beyond are most likely degrees."""

VOLTS_MAX = 60.0
QUIET_S = 2.0
STEPS_MIN = 100


@dataclass(frozen=True, slots=True)
class PitchRecord:
    """Angle and voltages, evenly sampled; the voltages of a sample are held until the next one."""

    step_s: float
    angle_rad: Array
    front_volts: Array
    rear_volts: Array

    def __post_init__(self) -> None:
        """Refuse what cannot be a record of a pitch axis."""
        if not (math.isfinite(self.step_s) and self.step_s > 0.0):
            raise IdentificationError(f"the sampling time is {self.step_s} s; it must be above 0")
        lengths = {len(self.angle_rad), len(self.front_volts), len(self.rear_volts)}
        if len(lengths) != 1:
            raise IdentificationError(f"angle and voltages have different lengths: {sorted(lengths)}")
        if len(self) < STEPS_MIN:
            raise IdentificationError(f"{len(self)} samples are too few; give at least {STEPS_MIN}")
        for name, values in (
            ("angle", self.angle_rad),
            ("front voltage", self.front_volts),
            ("rear voltage", self.rear_volts),
        ):
            bad = np.flatnonzero(~np.isfinite(values))
            if len(bad):
                raise IdentificationError(f"the {name} of sample {bad[0]} is not finite")
        largest = float(np.abs(self.angle_rad).max())
        if largest > ANGLE_MAX_RAD:
            raise IdentificationError(
                f"the pitch reaches {largest:.4g} rad, more than a turn: is the column in degrees or "
                "in counts? Say which"
            )
        largest = float(max(np.abs(self.front_volts).max(), np.abs(self.rear_volts).max()))
        if largest > VOLTS_MAX:
            raise IdentificationError(
                f"a motor voltage reaches {largest:.4g} V; is the column in millivolts or counts?"
            )

    def __len__(self) -> int:
        """Return the number of samples."""
        return len(self.angle_rad)

    @property
    def duration_s(self) -> float:
        """Return the time from the first sample to the last."""
        return (len(self) - 1) * self.step_s

    def part(self, start_s: float, end_s: float) -> PitchRecord:
        """Return the samples in `start_s <= t < end_s`."""
        cut = slice(math.ceil(start_s / self.step_s - 1e-6), math.ceil(end_s / self.step_s - 1e-6))
        return PitchRecord(
            self.step_s, self.angle_rad[cut], self.front_volts[cut], self.rear_volts[cut]
        )


@dataclass(frozen=True, slots=True)
class PitchIdentification:
    """The data of a record, and its origin."""

    estimates: PitchEstimates
    deviations: PitchEstimates
    condition: float
    """persistent-excitation measure, 0 to 1"""
    warnings: tuple[str, ...]
    times_s: Array
    history: Array
    """a row per sample: a_w, a_th, k_v, theta_0"""
    filtered_input_volts: Array
    """mu_f of Fig. 3"""


def identify(
    record: PitchRecord, equilibrium_rad: float | None, settings: PitchSettings | None = None
) -> PitchIdentification:
    """Run the on-line algorithm over a record; IdentificationError if there is nothing to learn."""
    identifier = PitchIdentifier(record.step_s, equilibrium_rad, settings)
    if np.ptp(record.angle_rad) == 0.0:
        raise IdentificationError(
            "the angle never changes: the encoder is not connected, or the column is a wrong one"
        )
    if np.ptp(record.front_volts - record.rear_volts) == 0.0:
        raise IdentificationError(
            "the voltage difference of the motors never changes, so the gain k_v cannot be found: "
            "are these the right columns?"
        )
    history = np.empty((len(record), 4))
    inputs = np.empty(len(record))
    rows = zip(
        record.front_volts.tolist(),
        record.rear_volts.tolist(),
        record.angle_rad.tolist(),
        strict=True,
    )
    for index, (front, rear, angle) in enumerate(rows):
        history[index] = identifier.take(front, rear, angle)
        inputs[index] = identifier.regressor_mu
    return PitchIdentification(
        identifier.estimates,
        identifier.deviations,
        identifier.estimator.condition,
        tuple(identifier.warnings()),
        np.arange(len(record), dtype=np.float64) * np.float64(record.step_s),
        history,
        inputs,
    )


@dataclass(frozen=True, slots=True)
class QuietStretch:
    """The angle of the body at rest with its motors off."""

    start_s: float
    end_s: float
    angle_rad: float
    """mean angle there: theta_0"""


def quiescent_angle(
    record: PitchRecord, *, volts: float = 0.05, spread_rad: float = 0.02, seconds: float = QUIET_S
) -> QuietStretch | None:
    """Return the longest stretch in which the body rests and the motors pull equally; None if none.

    It rests while its angle stays within `spread_rad` over `seconds` and the voltages differ by at
    most `volts`.
    """
    steps = max(2, round(seconds / record.step_s))
    if len(record) < steps:
        return None
    windows = np.lib.stride_tricks.sliding_window_view(record.angle_rad, steps)
    difference = np.abs(record.front_volts - record.rear_volts)
    pulls = np.lib.stride_tricks.sliding_window_view(difference, steps)
    quiet = (np.ptp(windows, axis=1) <= spread_rad) & (pulls.max(axis=1) <= volts)
    edges = np.flatnonzero(np.diff(np.concatenate(([False], quiet, [False])).astype(np.int8)))
    if not len(edges):
        return None
    starts, ends = edges[::2], edges[1::2]
    best = int(np.argmax(ends - starts))
    start, end = int(starts[best]), int(ends[best]) - 1 + steps
    mean = float(record.angle_rad[start:end].mean())
    return QuietStretch(start * record.step_s, end * record.step_s, mean)
