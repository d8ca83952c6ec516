"""Does the loop notice? The paper's reference, a plant 10 % off the model, against the usual loop."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import product
from typing import Any

from reproduction.limits.flight import PERIOD_S, fly_agreement
from tenbaud.build.flight import agree
from tenbaud.config.load import load_config

USUAL = "usual loop, 1000 bit/s"
PAPER_10 = "paper, 10 bit/s"
HISTORY_10 = "history, 10 bit/s"
PRESETS = {USUAL: "usual-1000baud", PAPER_10: "paper-10baud", HISTORY_10: "history-10baud"}
OFF = (-0.1, 0.1)
SIGNS = tuple((damping, stiffness, gain) for damping, stiffness, gain in product(OFF, OFF, OFF))
DISTURBANCES = ("", "q=0.002")
SECONDS = 125.0


@dataclass(frozen=True, slots=True)
class TrackingCase:
    """A loop, a plant off the model, and a seed."""

    loop: str
    disturbance: str
    mismatch: tuple[float, float, float]
    seed: int

    @property
    def name(self) -> str:
        """Return what is averaged over plants and seeds."""
        return f"{self.loop}|{self.disturbance}"


def tracking_cases(seeds: int) -> list[TrackingCase]:
    """Return every loop on all eight plants 10 % off; without torque one seed is enough."""
    return [
        TrackingCase(loop, disturbance, mismatch, seed)
        for loop in PRESETS
        for disturbance in DISTURBANCES
        for mismatch in SIGNS
        for seed in range(1, (seeds if disturbance else 1) + 1)
    ]


def fly_tracking(case: TrackingCase) -> float:
    """Return the mean square distance from the reference, in rad^2, after the first period.

    The encoder is the same in every loop, 4096 counts a turn; infinite when the estimate is lost.
    """
    overrides: dict[str, Any] = {
        "seed": case.seed,
        "duration_s": SECONDS,
        "transmitter": {
            "encoders": {"counts_per_turn": 4096},
            "plant": {"mismatch": case.mismatch, "disturbance": case.disturbance},
        },
        "link": {"kind": "memory"},
    }
    agreement = agree(load_config(PRESETS[case.loop], None, overrides), "virtual")
    found = fly_agreement(agreement, PERIOD_S).tracking
    return found if math.isfinite(found) else math.inf
