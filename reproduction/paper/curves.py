"""The curves of a recorded flight, as arrays."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tenbaud.recording.envelope import Series
from tenbaud.recording.reader import Recording


@dataclass(frozen=True, slots=True)
class Curves:
    """The curves of a figure, on the transmitter's ticks; the reference is on the receiver's."""

    times_s: Series
    pitch_rad: Series
    measured_rad: Series
    coded_rad: Series
    coded_rate: Series
    live_rad: Series
    range_times_s: Series
    range_rad: Series
    reference_rad: Series


def read_curves(transmitter: Path, receiver: Path) -> Curves:
    """Read both recordings of a flight; what is missing at a tick is NaN there."""
    recording = Recording(transmitter)
    ticks = [row for _, row in recording.rows("tick")]
    count = ticks[-1]["tick"] + 1
    columns = {name: np.full(count, np.nan) for name in ("pitch", "measured", "time", "reference")}
    for row in ticks:
        tick = row["tick"]
        columns["time"][tick] = row["time_s"]
        columns["measured"][tick] = row["measured"][0]
        columns["pitch"][tick] = (row["true"] or row["measured"])[0]
    coded, rate, live = (np.full(count, np.nan) for _ in range(3))
    for _, row in recording.rows("estimate"):
        tick = row["tick"]
        if tick < count:
            coded[tick], rate[tick] = row["coded_state"][:2]
            live[tick] = _first(row["live_state"])
    ranges = [(time_ns / 1e9, _first(row["range"])) for time_ns, row in recording.rows("sample")]
    for _, row in Recording(receiver).rows("tick"):
        if row["tick"] < count:
            columns["reference"][row["tick"]] = _first(row["reference"])
    times = np.array(ranges, dtype=np.float64).reshape(-1, 2)
    return Curves(
        columns["time"],
        columns["pitch"],
        columns["measured"],
        coded,
        rate,
        live,
        times[:, 0],
        times[:, 1],
        columns["reference"],
    )


def true_rate(curves: Curves) -> Series:
    """Return the rate of the true pitch, by central differences.

    The simulated pitch has neither noise nor steps, so the error is of the order of the tick squared.
    """
    return np.gradient(curves.pitch_rad, curves.times_s)


def _first(value: Any) -> float:
    if isinstance(value, list):
        value = value[0] if value else None
    return float("nan") if value is None else float(value)
