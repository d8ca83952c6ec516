"""A recording of a body that is pushed, made by the model of a preset."""

from __future__ import annotations

import csv
import random
from pathlib import Path
from typing import Any

from tenbaud.config.load import load_config
from tenbaud.config.schema import FlightConfig

TICK_S = 0.02


def pushed(path: Path, rows: int = 1000, seed: int = 7) -> Path:
    """Write a pitch that damping and stiffness hold, pushed now and then, as counts."""
    chance = random.Random(seed)
    angle = rate = push = 0.0
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(("step", "pitch_counts", "right_volts", "left_volts"))
        for step in range(rows):
            volts = 0.5 if step // 150 % 2 else -0.5
            writer.writerow((step, round(angle * 4096 / 6.283185307179586), volts, -volts))
            if step % 70 == 0:
                push = chance.uniform(-3.0, 3.0)
            push = 0.0 if step % 70 > 12 else push
            rate += TICK_S * (push + 2.0 * volts - 3.0 * angle - 1.5 * rate)
            angle += TICK_S * rate
    return path


def changes_of(log: Path) -> dict[str, Any]:
    """Return the settings of a replay of such a recording."""
    return {
        "transmitter": {"rig": "replay"},
        "receiver": {"controller": "recorded"},
        "flight_log": {"file": str(log)},
        "duration_s": 20.0,
    }


def config_of(log: Path) -> FlightConfig:
    """Return the replay of such a recording by the coder `history` at 10 bit/s."""
    return load_config("uiuc-history-10baud", None, changes_of(log))
