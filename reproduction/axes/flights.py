"""Whole flights for the page, compiled: the boxes, and three fixed coders at the same rate."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Sequence
from typing import Any, NamedTuple

from reproduction.axes.alone import DENSITIES, OUTPUTS
from reproduction.limits.intervals import Ratio, mean_of
from tenbaud.config.load import checked, load_config, merged_values
from tenbaud.config.schema import FlightConfig
from tenbaud.design.complete import completed
from tenbaud.design.described import FOLDER
from tenbaud.studies.chunk import fly_point

USUAL = "helicopter-usual"
PRESETS = (
    "helicopter-10baud",
    "helicopter-20baud",
    "helicopter-30baud",
    "helicopter-3x10baud",
    USUAL,
)
BOXES_S, LINEAR_S = 80.0, 120.0
FINE_COUNTS = 10_000_000
BOXES = {
    "kind": "square",
    "amplitude": 0.4,
    "period_s": 40.0,
    "elevation": {"kind": "square", "amplitude": 0.1, "period_s": 20.0},
}
FIXED_CODER = {
    "kind": "zoom",
    "window_signs": 3,
    "initial_range_rad": 0.02,
    "minimum_range_rad": 0.00534,
    "decay": 0.8925,
    "correction": "impulse",
    "gains": [0.7847, 2.4458],
}
"""Constants: a search for the least error on two flights of two minutes, of other seeds."""


class Tracked(NamedTuple):
    """A preset through the boxes."""

    preset: str
    bit_s: float
    tracking: tuple[Ratio, ...]
    """rms distance from the set-point of travel and elevation, rad"""
    estimate_mrad: tuple[Ratio, ...]
    """rms error of the live estimate of each output"""


def tracked(preset: str, seeds: Sequence[int], seconds: float = BOXES_S) -> Tracked:
    """Fly a preset through its boxes, 10 % off its model, disturbed as it says."""
    config = load_config(preset, None, {"duration_s": seconds})
    flown = fly_point(config, seeds, "auto")
    return Tracked(
        preset,
        config.channel.rate_baud,
        tuple(mean_of([one.outputs[at].tracking_rms for one in flown]) for at in (0, 1)),
        tuple(
            mean_of([1e3 * one.outputs[at].error_live_rms for one in flown])
            for at in range(len(OUTPUTS))
        ),
    )


def linear_flight(
    coder: dict[str, Any], symbol_period_s: float, seconds: float, densities: tuple[float, ...]
) -> FlightConfig:
    """Return a flight of the linear plant, which the codec knows exactly, at 10 bit/s in all."""
    model = tomllib.loads((FOLDER / "helicopter.toml").read_text(encoding="utf-8"))["model"]
    values = completed(
        {
            "duration_s": seconds,
            "timing": {"tick_s": 0.01, "symbol_period_s": symbol_period_s},
            "channel": {"rate_baud": 10.0},
            "model": {**model, "densities": list(densities)},
            "coder": coder,
            "limits": {"command_max": 20.0},
            "transmitter": {
                "encoders": {"counts_per_turn": FINE_COUNTS},
                "plant": {"disturbance": f"q={':'.join(map(repr, densities))}"},
            },
            "receiver": {"controller": "state_feedback", "reference": BOXES},
        }
    )
    return checked(merged_values("own", None, values))


def errors_in_all(
    coder: dict[str, Any], seeds: Sequence[int], seconds: float = LINEAR_S
) -> list[float]:
    """Return the rms error of all outputs together of each flight, q unequal."""
    period_s = 0.1 if coder["kind"] == "direction" else 0.3
    config = linear_flight(coder, period_s, seconds, DENSITIES["unequal"])
    flown = fly_point(config, seeds, "compiled")
    return [math.sqrt(sum(out.error_coded_rms**2 for out in one.outputs)) for one in flown]
