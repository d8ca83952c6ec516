"""One synthetic flight of a laboratory, written as laboratories write their files."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path

import numpy as np

from plant_sim.pitch import PitchParameters, PitchPlant
from tenbaud.log.table import Array

TICK_S = 0.02
ROWS = 1500
TRUE = PitchParameters(0.4, 4.0, 0.2, equilibrium_rad=0.0, volts_max=12.0)
"""The plant of the flight; its files hold rad to five digits, s, V."""


Fields = dict[str, object]
Dialect = tuple[list[str], str, str, Fields]
"""Lines, encoding, line end, and the fields of the section that reads it."""


@cache
def flight() -> tuple[Array, Array, Array, Array]:
    """Return time, angle, front and rear voltage of 30 s: rest, then voltages that switch."""
    plant = PitchPlant(TRUE, TICK_S)
    random = np.random.default_rng(7)
    rows, level = [], 0.0
    for tick in range(ROWS):
        if tick >= 100 and tick % 25 == 0:
            level = float(random.choice((-4.0, -2.0, 0.0, 2.0, 4.0)))
        front, rear = max(level, 0.0), max(-level, 0.0)
        rows.append((tick * TICK_S, plant.angle_rad, front, rear))
        plant.advance((front, rear))
    time_s, angle_rad, front_volts, rear_volts = np.array(rows).T
    return time_s, angle_rad, front_volts, rear_volts


def lines(
    rows: Array | Sequence[Sequence[float]], separator: str = ",", decimal: str = ".", form: str = ".5f"
) -> list[str]:
    """Return rows of numbers as lines."""
    line = separator.join([f"%{form}"] * len(rows[0]))
    return [(line % tuple(row)).replace(".", decimal) for row in np.asarray(rows).tolist()]


def table(change: Callable[[Array], Array] = lambda angle: angle) -> Array:
    """Return the flight as rows of time, angle, front and rear voltage."""
    time_s, angle_rad, front_volts, rear_volts = flight()
    return np.column_stack([time_s, change(angle_rad), front_volts, rear_volts])


def wrapped(angle_rad: Array) -> Array:
    """Return the angle as a compass shows it: from 0 to 360 degrees."""
    return np.degrees(angle_rad) % 360.0


def write(path: Path, text: str | list[str], encoding: str = "utf-8", end: str = "\n") -> Path:
    """Write lines, or text, and return the path."""
    whole = text if isinstance(text, str) else end.join(text) + end
    path.write_bytes(whole.encode(encoding))
    return path


@cache
def dialects() -> dict[str, Dialect]:
    """Return each way to write the flight."""
    rows = table()
    named: Fields = {"columns": {"angle": "angle", "front": "u1", "rear": "u2", "time": "time"}}
    header, comma = "time,angle,u1,u2", lines(rows)
    german = table(np.degrees)
    numbers: Fields = {"columns": {"time": "1", "angle": "2", "front": "3", "rear": "4"}}
    in_rad: Fields = {"units": {"angles": "rad"}}
    lost = {"columns": {"angle": "a, measured", "front": "u1", "rear": "u2", "time": "time"}}
    return {
        "plain": ([header, *comma], "utf-8", "\n", named | in_rad),
        "guessed": ([header, *comma], "utf-8", "\n", {}),
        "crlf and mark": ([header, *comma], "utf-8-sig", "\r\n", named),
        "old mac": ([header, *comma], "utf-8", "\r", named),
        "utf-16": ([header, *comma], "utf-16", "\r\n", named),
        "tabs": ([header.replace(",", "\t"), *lines(rows, "\t")], "utf-8", "\n", named),
        "blanks": ([f"   {line}" for line in lines(rows, "   ")], "utf-8", "\n", numbers | in_rad),
        "semicolons": (
            ["Zeit [s];Winkel [°];U1 [V];U2 [V]", *lines(german, ";", ",", ".4f")],
            "utf-8",
            "\n",
            {
                "columns": {
                    "angle": "Winkel [°]",
                    "front": "U1 [V]",
                    "rear": "U2 [V]",
                    "time": "Zeit [s]",
                }
            },
        ),
        "latin-1, guessed": (
            ["Zeit [s];Winkel [°];U1 [V];U2 [V]", *lines(german, ";", ",", ".4f")],
            "latin-1",
            "\r\n",
            {},
        ),
        "tabs, decimal commas": (
            ["t\tpitch_deg\tu1\tu2", *lines(german, "\t", ",", ".4f")],
            "utf-8",
            "\n",
            {},
        ),
        "comments": (["# rig 3, run 7", "# 50 Hz", header, *comma], "utf-8", "\n", named),
        "percent": (["% a log", *comma[:7], "% pause", *comma[7:]], "utf-8", "\n", numbers | in_rad),
        "header in a comment": (["# time angle u1 u2", *lines(rows, " ")], "utf-8", "\n", named),
        "slashes": (["// by the board", header, *comma], "utf-8", "\n", named),
        "titles": (["Recorder 2000", "Run;7;of 9", "", header, *comma], "utf-8", "\n", named),
        "units row": ([header, "s,rad,V,V", *comma], "utf-8", "\n", named),
        "units row in degrees": ([header, "[s],[deg],[V],[V]", *lines(german)], "utf-8", "\n", named),
        "no header": (comma, "utf-8", "\n", numbers | in_rad),
        "short header": (['"Time","data"', *comma], "utf-8", "\n", numbers | in_rad),
        "commas in names": (['time,"a, measured",u1,u2', *comma], "utf-8", "\n", lost | in_rad),
        "text beside": ([f"{header},note", *(f"{one},ok" for one in comma)], "utf-8", "\n", named),
        "comma at the end": ([f"{header},", *(f"{one}," for one in comma)], "utf-8", "\n", named),
    } | numbers_of_other_kinds(named)


def numbers_of_other_kinds(named: Fields) -> dict[str, Dialect]:
    """Return files whose clock or angle is written in another way."""
    rows = table()
    header, comma = "time,angle,u1,u2", lines(rows)
    milli = np.add(rows * 1000.0, (5000.0, 0.0, 0.0, 0.0))
    dates = [
        f"2024-05-06 07:{int(t // 60):02}:{t % 60:06.3f},{','.join(rest)}"
        for t, rest in zip(rows[:, 0], (line.split(",")[1:] for line in comma), strict=True)
    ]
    return {
        "milli": (["time_ms,angle_mrad,u1 (mV),u2 (mV)", *lines(milli)], "utf-8", "\n", {}),
        "dates": ([header, *dates], "utf-8", "\n", named),
        "wrapped": (["time,angle_deg,u1,u2", *lines(table(wrapped))], "utf-8", "\n", {}),
        "epoch": ([header, *lines(np.add(rows, (1.7e9, 0, 0, 0)))], "utf-8", "\n", named),
        "scaled": (
            [header, *lines(rows * (1, -math.tau, 50, 50))],
            "utf-8",
            "\n",
            {
                "signs": {"pitch": -1},
                "scales": {"angle": 1.0 / math.tau, "inputs": 0.02},
                "units": {"pitch": "rad"},
            },
        ),
    }
