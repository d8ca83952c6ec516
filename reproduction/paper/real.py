"""The recorded flights of real helicopters, sent through the same two processes.

Time splits the UIUC recording in half. A model is identified on the first half, the tuned presets
were fitted on the first half, and errors count on the second half alone, which is flown as the
continuation of the first.
"""

from __future__ import annotations

import csv
import io
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from plant_sim.identification import simulation
from plant_sim.identification.pipeline import Options, identify
from plant_sim.identification.regression import regress
from plant_sim.identification.segments import cut
from plant_sim.identification.structures import PitchStructure
from reproduction.paper.flights import Job, Overrides
from reproduction.paper.identified import MOTOR_LAG_S
from tenbaud.config.load import load_config
from tenbaud.files.whole import write_whole
from tenbaud.identification.sources import from_log

UIUC_FILE = "uiuc_closed_loop.csv"
NTNU_FILES = ("ntnu_travel_step.csv", "ntnu_elevation_obstacle.csv")
TICK_S = 0.02
HALF_S = 60.0
RATES = ((10, 0.1), (16, 0.06), (25, 0.04), (50, 0.02))
"""Name of the rate, bit/s in whole numbers, and the time of one bit."""

BANDWIDTH_RAD_S = 8.0
SEGMENT_S = 0.6
"""Between two pushes of a hand: the body is its own only for so long."""

WORD_BITS = 10


@dataclass(frozen=True, slots=True)
class FirstHalf:
    """The model identified from the first half of the recording."""

    regression: dict[str, float]
    """by field of the model, of the regression alone"""
    warnings: tuple[str, ...]
    """what is said about it"""
    deviations: dict[str, float]
    """of the model's fields"""
    model: dict[str, Any]


def identify_first_half(data: Path) -> FirstHalf:
    """Identify the body on the first half.

    People push it, so the regression is disturbed by torques that the log does not hold, and its
    damping is negative. The model is therefore that of the simulation-error fit over stretches of
    0.6 s, with a damping of 0.
    """
    log = {"file": str(data / UIUC_FILE), "end_s": HALF_S, "period_s": TICK_S}
    record, _ = from_log(load_config("uiuc-10baud", None, {"flight_log": log}))
    options = Options(MOTOR_LAG_S, BANDWIDTH_RAD_S)
    whole = identify(record, PitchStructure(), options)
    structure = PitchStructure(damped=False)
    segments = cut(record, structure, SEGMENT_S)
    start = regress(record, structure, whole.regression.filters)
    fitted = simulation.fit(segments, structure, start.values, MOTOR_LAG_S)
    found = structure.parameters(fitted.values, fitted.covariance)
    alone = whole.structure.parameters(whole.regression.values, whole.regression.covariance)
    return FirstHalf(
        {one.name: one.value for one in alone},
        (*whole.warnings, *whole.refused),
        {one.name: one.deviation for one in found},
        {
            "kind": "pitch",
            **{one.name: round(one.value, 6) for one in found},
            "motor_lag_s": MOTOR_LAG_S,
        },
    )


def replayed(file: Path, **sections: Any) -> Overrides:
    """Return what makes a flight the replay of a recording."""
    return {
        **sections,
        "transmitter": {"rig": "replay", **sections.get("transmitter", {})},
        "receiver": {"controller": "recorded"},
        "flight_log": {"file": str(file), **sections.get("flight_log", {})},
    }


def uiuc_jobs(data: Path, model: dict[str, Any]) -> list[Job]:
    """Return the flights over the UIUC recording."""
    file = (data / UIUC_FILE).resolve()
    jobs = []
    for rate, period_s in RATES:
        timing = {"tick_s": TICK_S, "symbol_period_s": period_s}
        channel = {"rate_baud": 1.0 / period_s}
        paper = replayed(file, timing=timing, channel=channel, model=model, duration_s=2.0 * HALF_S)
        jobs += [
            Job(f"uiuc-paper-{rate}", "paper-10baud", paper, window_start_s=HALF_S),
            Job(
                f"uiuc-tuned-{rate}",
                f"uiuc-{rate}baud",
                replayed(file),
                processes=rate < 50,
                window_start_s=HALF_S,
                keep_series=rate == 10,
            ),
            Job(
                f"uiuc-pcm-{rate}",
                "usual-1000baud",
                _words(file, WORD_BITS * period_s),
                window_start_s=HALF_S,
            ),
        ]
    every_tick = _words(file, TICK_S)
    return [*jobs, Job("uiuc-pcm-500", "usual-1000baud", every_tick, window_start_s=HALF_S)]


def _words(file: Path, period_s: float) -> Overrides:
    return replayed(
        file,
        timing={"tick_s": TICK_S, "symbol_period_s": period_s},
        channel={"rate_baud": WORD_BITS / period_s},
        transmitter={"encoders": {"counts_per_turn": 4096}},
        duration_s=2.0 * HALF_S,
    )


def ntnu_jobs(data: Path, folder: Path) -> list[Job]:
    """Return the flights over the NTNU recordings, brought into the form of a flight log."""
    jobs = []
    for name in NTNU_FILES:
        if not (data / name).is_file():
            continue
        log = folder / f"{Path(name).stem}-counts.csv"
        seconds = convert_ntnu(data / name, log)
        for preset in ("paper-10baud", "tuned-10baud", "tuned-20baud"):
            overrides = replayed(log.resolve(), duration_s=seconds)
            jobs.append(Job(f"{Path(name).stem}-{preset}", preset, overrides, window_start_s=0.0))
    return jobs


def convert_ntnu(source: Path, target: Path) -> float:
    """Write every fifth row (100 Hz) as encoder counts with zero voltages; return its seconds.

    The recordings hold no voltages, so the commands are unknown and no torque is assumed.
    """
    with source.open(newline="", encoding="utf-8") as file:
        reader = csv.DictReader(file)
        in_degrees = "pitch_deg" in (reader.fieldnames or ())
        column = "pitch_deg" if in_degrees else "pitch_rad"
        angles = np.array([float(row[column]) for row in reader])[::5]
    turns = angles / (360.0 if in_degrees else math.tau)
    counts = np.floor(turns * 4096.0 + 0.5).astype(int)
    text = io.StringIO(newline="")
    writer = csv.writer(text)
    writer.writerow(("step", "pitch_counts", "right_volts", "left_volts"))
    writer.writerows((step, count, 0, 0) for step, count in enumerate(counts.tolist()))
    write_whole(target, text.getvalue())
    return len(counts) * 0.01
