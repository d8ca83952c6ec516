"""The recorded flights with all angles on one wire: `python -m reproduction.joint DATA [FILE [RATE]]`.

A linear model of all angles is fitted to the first half of a file by least squares, with the densities
of what it leaves unexplained; the `direction` coder is designed for it. Both are then frozen, and the
second half is flown from every sample phase.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import lsq_linear
from scipy.signal import savgol_filter

from channel.flight_log import FlightLog
from tenbaud.bounds.linear import Matrix
from tenbaud.build.flight_log import read_flight_log
from tenbaud.build.recorded import flight_config
from tenbaud.config.schema import FlightConfig
from tenbaud.design.complete import completed
from tenbaud.studies.bench import Bench
from tenbaud.studies.records import Variant, phases_of, rows

RATES = (10, 20, 30)
SMOOTHED_S = 0.25
"""window of the cubic that the derivatives are taken from"""
WHITE_S = 0.1
"""time over which what is unexplained is taken for white"""
DAMPING_LEAST_PER_S = 0.1
"""of a model: what a rig under its own controller shows as growth is the controller's"""
COUNTS = {"travel": 8192, "elevation": 4096, "pitch": 4096}


class Recording(NamedTuple):
    """A file, and what its columns are."""

    file: str
    outputs: dict[str, str]
    inputs: dict[str, str]
    log: dict[str, Any]


RECORDINGS = (
    Recording(
        "uiuc_closed_loop.csv",
        {name: f"{name}_counts" for name in COUNTS},
        {"right": "right_volts", "left": "left_volts"},
        {"units": {"angles": "counts"}, "period_s": 0.02},
    ),
    Recording(
        "ntnu_travel_step.csv",
        {"travel": "travel_deg", "pitch": "pitch_deg"},
        {"none": "0"},
        {},
    ),
    Recording(
        "ntnu_elevation_obstacle.csv",
        {name: f"{name}_rad" for name in COUNTS},
        {"none": "0"},
        {},
    ),
)


class Row(NamedTuple):
    """A line of the table."""

    file: str
    rate: int
    output: str
    rms: float
    """of the receiver's estimate, mean over the phases, rad"""
    worst: float
    largest_error: float
    largest: float
    """angle in the second half, rad"""


def settings_of(data: Path, recording: Recording, rate: int, model: dict[str, Any]) -> dict[str, Any]:
    """Return the settings of a replay by a linear model."""
    # 30 bit/s make no whole number of the usual ticks.
    tick_s = 0.01 if rate != 30 else 1.0 / 60.0
    encoders = {name: {"counts_per_turn": COUNTS[name]} for name in recording.outputs}
    log = {"columns": {**recording.outputs, **recording.inputs}, **recording.log}
    return {
        "timing": {"tick_s": tick_s, "symbol_period_s": 1.0 / rate},
        "channel": {"rate_baud": float(rate)},
        "model": {"kind": "linear", **model},
        "coder": {"kind": "direction"},
        "transmitter": {"rig": "replay", "encoders": encoders},
        "receiver": {"controller": "recorded"},
        "flight_log": {"file": str(data / recording.file), **log},
    }


def joint_flight(data: Path, recording: Recording, rate: int) -> tuple[FlightConfig, FlightLog, int]:
    """Return the frozen configuration, the record, and the tick at which its second half begins."""
    outputs, inputs = list(recording.outputs), list(recording.inputs)
    blank = np.zeros((2 * len(outputs), 2 * len(outputs) + len(inputs) + 1))
    values = settings_of(data, recording, rate, model_of(blank, outputs, inputs, [1.0] * len(outputs)))
    log = read_flight_log(flight_config("own", None, completed(values)))
    border = len(log) // 2
    values["model"] |= fitted(rows(log, 0, border), outputs, inputs)
    return flight_config("own", None, completed(values)), log, border


def fitted(log: FlightLog, outputs: list[str], inputs: list[str]) -> dict[str, Any]:
    """Return the linear model whose accelerations are nearest to those of a record."""
    count, tick_s = len(outputs), log.tick_s
    window = 2 * round(0.5 * SMOOTHED_S / tick_s) + 1
    angle, rate, acceleration = (
        savgol_filter(log.measured, window, 3, deriv=order, delta=tick_s, axis=0) for order in range(3)
    )
    found = np.zeros((count, 2 * count + len(inputs) + 1))
    left = np.zeros_like(acceleration)
    driven = np.column_stack((log.commands, np.ones(len(angle))))
    for place, name in enumerate(outputs):
        # The pitch turns the arm; a body that people push does not show more of what is coupled.
        used = [place, count + place, *range(2 * count, found.shape[1])]
        used += [outputs.index("pitch")] if name == "travel" else []
        known = np.column_stack((angle, rate, driven))[:, used]
        low = np.full(len(used), -np.inf)
        high = np.array([0.0, -DAMPING_LEAST_PER_S, *[np.inf] * (len(used) - 2)])
        if name == "travel":
            low[0], high[0] = -1e-9, 1e-9  # nothing holds it anywhere
        solved = lsq_linear(known, acceleration[:, place], (low, high)).x
        found[place, used] = solved
        left[:, place] = acceleration[:, place] - known @ solved
    size = max(1, round(WHITE_S / tick_s))
    means = left[: len(left) // size * size].reshape(-1, size, count).mean(axis=1)
    densities = (means**2).mean(axis=0) * size * tick_s
    rows_of_rates = np.vstack([np.zeros_like(found), found])
    return model_of(rows_of_rates, outputs, inputs, densities.tolist())


def model_of(
    rates: Matrix, outputs: list[str], inputs: list[str], densities: list[float]
) -> dict[str, Any]:
    """Return the settings of a model; `rates` has columns for angles, rates, inputs and 1."""
    count = len(outputs)
    A, B, constant = rates[:, : 2 * count].copy(), rates[:, 2 * count : -1], rates[:, -1]
    A[:count, count:] = np.eye(count)
    if not A[count:, :count].any():
        B = B + np.concatenate([np.zeros(count), np.ones(count)])[:, None]
    at = np.linalg.lstsq(np.hstack([A, B]), -constant, rcond=1e-9)[0]
    names = [*outputs, *[f"{name}_rate" for name in outputs]]
    return {
        "A": A.tolist(),
        "B": B.tolist(),
        "C": np.eye(count, 2 * count).tolist(),
        "G": np.eye(2 * count)[:, count:].tolist(),
        "densities": densities,
        "operating_state": at[: 2 * count].tolist(),
        "operating_command": at[2 * count :].tolist(),
        "states": names,
        "state_units": ["rad"] * count + ["rad/s"] * count,
        "inputs": inputs,
        "input_units": ["V"] * len(inputs),
    }


def rows_of(data: Path, recording: Recording, rate: int) -> list[Row]:
    """Fly the second half from every sample phase."""
    config, log, border = joint_flight(data, recording, rate)
    phases = phases_of(config, 50)
    flown = Bench(config, [Variant(log, 1.0, 1.0)], phases, border).fly(config)
    found = []
    for place, name in enumerate(recording.outputs):
        errors = [one.outputs[place].error_live_rms for one in flown]
        largest_error = max(one.outputs[place].error_live_max for one in flown)
        largest = float(np.abs(log.measured[border:, place]).max())
        mean = float(np.mean(errors))
        found.append(Row(recording.file, rate, name, mean, max(errors), largest_error, largest))
    return found


def main() -> None:
    """Print the rows that are asked for."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("data", type=Path, help="folder of the recordings")
    parser.add_argument("only", nargs="*", help="part of a file's name, or a rate in bit/s")
    given = parser.parse_args()
    print("| recording | bit/s, all angles | angle | rms | worst phase | rms % | largest error % |")
    print("|---|---|---|---|---|---|---|", flush=True)
    for recording in RECORDINGS:
        for rate in RATES:
            if not all(one in recording.file or one == str(rate) for one in given.only):
                continue
            for row in rows_of(given.data, recording, rate):
                shares = (100.0 * one / row.largest for one in (row.rms, row.largest_error))
                degrees = (f"{np.degrees(one):.2f}°" for one in (row.rms, row.worst))
                percent = (f"{one:.2f}" for one in shares)
                print(
                    "|",
                    " | ".join([row.file, str(rate), row.output, *degrees, *percent]),
                    "|",
                    flush=True,
                )


if __name__ == "__main__":
    main()
