"""The table of recorded flights: every angle of every file, with constants from its first half alone.

    python -m reproduction.recordings DATA [FILE ANGLE RATE]

For each angle and rate, `quick_coder` finds coder constants for a model that knows nothing of the body,
and `tune` fits model and coder to variants of the first half. The second half is then flown from every
sample phase.
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from channel.errors import TenbaudError
from tenbaud.build.recorded import flight_config
from tenbaud.config.load import merged
from tenbaud.studies.constants import free_ranges
from tenbaud.studies.judging import Split, Tuning
from tenbaud.studies.quick import quick_coder
from tenbaud.studies.study_file import Range
from tenbaud.studies.tuning import preset_text, tune

RATES = (10, 20, 25)
EVALUATIONS = 600
UNKNOWN_BODY = {
    "rate_damping_per_s": 1.0,
    "stiffness_per_s2": 1.0,
    "torque_gain_rad_per_v_s2": 1.0,
    "motor_lag_s": 0.2,
}
BODY_RANGES = {
    "model.rate_damping_per_s": (0.1, 10.0, "log"),
    "model.stiffness_per_s2": (-2.0, 10.0, "linear"),
    "model.torque_gain_rad_per_v_s2": (-3.0, 3.0, "linear"),
    "model.motor_lag_s": (0.02, 1.0, "log"),
    "model.equilibrium_rad": (-0.5, 0.5, "linear"),
}
NO_INPUT = {"front": "0", "rear": "0"}


@dataclass(frozen=True, slots=True)
class Angle:
    """An angle of a file."""

    file: str
    name: str
    section: dict[str, Any]
    """of the flight log"""
    counts_per_turn: int = 4096
    timing: dict[str, float] = field(default_factory=dict)


def _uiuc(name: str, counts_per_turn: int, inputs: dict[str, str], **section: Any) -> Angle:
    # The file counts its rows; they are 0.02 s apart.
    columns = {"pitch": f"{name}_counts", **inputs}
    log = {"columns": columns, "units": {"angles": "counts"}, "period_s": 0.02, **section}
    return Angle("uiuc_closed_loop.csv", name, log, counts_per_turn)


def _ntnu(file: str, name: str, unit: str) -> Angle:
    log = {"columns": {"pitch": f"{name}_{unit}", **NO_INPUT}}
    # Recorded at 500 Hz; a fifth of it shows these motions as well.
    return Angle(file, name, log, timing={"tick_s": 0.01})


MOTORS = {"front": "right_volts", "rear": "left_volts"}
ANGLES = (
    _uiuc("pitch", 4096, MOTORS),
    # Both motors lift: their sum is the difference from a reversed one.
    _uiuc("elevation", 4096, MOTORS, signs={"rear": -1}),
    _uiuc("travel", 8192, NO_INPUT),
    _ntnu("ntnu_travel_step.csv", "travel", "deg"),
    _ntnu("ntnu_travel_step.csv", "pitch", "deg"),
    _ntnu("ntnu_elevation_obstacle.csv", "travel", "rad"),
    _ntnu("ntnu_elevation_obstacle.csv", "pitch", "rad"),
    _ntnu("ntnu_elevation_obstacle.csv", "elevation", "rad"),
)


def settings_of(data: Path, angle: Angle, rate: int) -> dict[str, Any]:
    """Return the settings of a replay of one angle by a model that knows nothing of the body."""
    return {
        "timing": {"symbol_period_s": 1.0 / rate, **angle.timing},
        "channel": {"rate_baud": float(rate)},
        "model": UNKNOWN_BODY,
        "transmitter": {"rig": "replay", "encoders": {"counts_per_turn": angle.counts_per_turn}},
        "receiver": {"controller": "recorded"},
        "flight_log": {"file": str(data / angle.file), **angle.section},
    }


def row_of(data: Path, angle: Angle, rate: int) -> str:
    """Fit on the first half, fly the second once, and return a row of the table."""
    settings = settings_of(data, angle, rate)
    config = flight_config("paper-10baud", None, settings)
    begun = time.monotonic()
    quick = quick_coder(config, until_s=0.5 * config.duration_s)
    settings = merged(settings, quick.sections)
    split = Split((), (), 0.5)
    tuning = Tuning("paper-10baud", None, settings, {}, split, evaluations=EVALUATIONS)
    ranges = {
        name: Range.model_validate({"from": first, "to": last, "scale": scale})
        for name, (first, last, scale) in BODY_RANGES.items()
    }
    tuning.free.update(free_ranges(tuning.config({}), {}, model=False) | ranges)
    tuned = tune(tuning, _progress)
    print(angle, rate, preset_text(tuning, tuned), file=sys.stderr, flush=True)
    largest = tuned.test_amplitude
    shares = (tuned.test_after, max(tuned.test_each), tuned.test_largest)
    figures = " | ".join(f"{100.0 * share / largest:.2f}" for share in shares)
    return (
        f"| {angle.file} | {angle.name} | {rate} | {figures} | {largest:.3f} | "
        f"{100.0 * quick.rms[0] / largest:.2f} | {time.monotonic() - begun:.0f} |"
    )


def _progress(count: int, error: float) -> None:
    if count % 100 == 0:
        print(count, f"{error:.5f}", file=sys.stderr, flush=True)


def _row_or_reason(data: Path, angle: Angle, rate: int) -> str:
    try:
        return row_of(data, angle, rate)
    except TenbaudError as error:
        return f"| {angle.file} | {angle.name} | {rate} | {error} |"


def main() -> None:
    """Print the rows that are asked for."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("data", type=Path, help="folder of the recordings")
    parser.add_argument("only", nargs="*", help="part of a file's name, an angle, or a rate in bit/s")
    given = parser.parse_args()
    print("| file | angle | bit/s | rms %, mean of phases | worst phase | largest error % ", end="")
    print("| largest angle, rad | quick_coder, first half, rms % | seconds |")
    print("|---|---|---|---|---|---|---|---|---|", flush=True)
    for angle in ANGLES:
        for rate in RATES:
            chosen = (angle.file.partition("_")[0], angle.name, str(rate))
            if all(one in chosen or one in angle.file for one in given.only):
                print(_row_or_reason(given.data, angle, rate), flush=True)


if __name__ == "__main__":
    main()
