"""The coders that are compared, as configurations for a rate and a disturbance strength.

Ranges of coders that *know q* are in units of `u = sqrt(q T^3)`, the angle by which white torque of
density q moves the body within a sample. The floor knows q too. The other coders adapt their range.
The numbers were found by a search over simulated double integrators in these units (T = q = 1), where
a coder is the same at any rate.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

Section = dict[str, Any]
Row = tuple[float, float, float]

NOMINAL_DENSITY = 2e-3
"""rad^2/s^3: the density that a coder without knowledge of q assumes"""

AIMED_ANGLE, AIMED_RATE, AIM = 1.3811, 1.4703, 1.4626

STEADY_ROWS: tuple[Row, ...] = (
    (1.2590, 0.5005, 1.0),
    (1.6289, 1.1991, 1.0),
    (1.1004, 1.3958, 1.0),
    (2.0449, 1.1509, 1.0),
    (1.3108, 0.6885, 1.0),
    (1.3165, 1.1531, 1.0),
    (0.9882, 1.0167, 1.0),
    (2.4993, 1.5357, 1.0),
)
STEADY_WEIGHTS = (0.7226, 0.6446, 1.1142)
STEADY_LOOKAHEAD = 1

FOLLOWING_ROWS: tuple[Row, ...] = (
    (0.8558, 0.6828, 0.7039),
    (1.1604, 0.9454, 1.1216),
    (0.6578, 1.4987, 0.9778),
    (1.2597, 1.6232, 1.3102),
    (0.6982, 0.5123, 0.8487),
    (1.4125, 0.9233, 1.3606),
    (0.9841, 0.8607, 0.8548),
    (1.3994, 1.0659, 1.1252),
)
FOLLOWING_WEIGHTS = (0.7244, 0.4346, 0.7453)
FOLLOWING_LOOKAHEAD = 2
FOLLOWING_SPAN = 30.0
"""How far below its first value the range may fall."""
RANGE_MAX_RAD = 3.0


@dataclass(frozen=True, slots=True)
class Candidate:
    """A coder of the table."""

    name: str
    key: str
    knows_q: bool
    """whether its constants know q"""
    coder: Callable[[float, float], Section]
    """(T in s, q in rad^2/s^3) -> section `coder` of a configuration"""

    def section(self, rate_bit_s: float, density: float) -> Section:
        """Return the coder at a rate, with the density if its constants depend on it."""
        return self.coder(1.0 / rate_bit_s, density if self.knows_q else NOMINAL_DENSITY)


def unit_rad(period_s: float, density: float) -> float:
    """Return u = sqrt(q T^3)."""
    return math.sqrt(density * period_s**3)


def _paper(period_s: float, density: float) -> Section:
    return {"kind": "zoom"}


def _three_signs(period_s: float, density: float) -> Section:
    return {"kind": "zoom", "window_signs": 3}


def _tuned(period_s: float, density: float) -> Section:
    unit = unit_rad(period_s, density)
    return {
        "kind": "zoom",
        "window_signs": 3,
        "initial_range_rad": 2.0 * unit,
        "minimum_range_rad": 1.984 * unit,
        "decay": 0.999,
        "correction": "impulse",
        "gains": [0.8075, 0.5230 / period_s],
    }


def _history(
    rows: tuple[Row, ...], weights: tuple[float, float, float], lookahead: int, span: float
) -> Callable[[float, float], Section]:
    def section(period_s: float, density: float) -> Section:
        unit = unit_rad(period_s, density)
        return {
            "kind": "history",
            "rows": [list(row) for row in rows],
            "initial_range_rad": unit,
            "minimum_range_rad": unit / span,
            "maximum_range_rad": unit if span == 1.0 else max(unit, RANGE_MAX_RAD),
            "weights": list(weights),
            "lookahead": lookahead,
        }

    return section


def innovation_gains() -> tuple[float, float]:
    """Return the steady-state gains (angle, rate times T) of the sign-of-innovation Kalman filter.

    T = q = 1. Ribeiro, Giannakis and Roumeliotis, IEEE Trans. Signal Processing 54, 2006: the sign of
    the innovation corrects by `sqrt(2/pi) P c / sqrt(c' P c)` and takes `2/pi` of what the innovation
    itself would take from the covariance. c = (1, 0): the angle is measured.
    """
    aa, ar, rr = 1.0, 0.5, 1.0
    share = 2.0 / math.pi
    for _ in range(10_000):
        after_aa = aa - share * aa
        after_ar = ar - share * ar
        after_rr = rr - share * ar * ar / aa
        aa = after_aa + 2.0 * after_ar + after_rr + 1.0 / 3.0
        ar = after_ar + after_rr + 0.5
        rr = after_rr + 1.0
    size = math.sqrt(share / aa)
    return size * aa, size * ar


def aimed_weights(angle: float, rate: float, aim: float) -> tuple[float, float, float]:
    """Return weights with which one row asks for the sign of `e + aim r`, r the rate error times T."""
    if aim > 0.0:
        return 1.0 / angle, 0.0, aim / rate
    small = 0.1 / angle
    return 1.0 / angle, -small * rate / angle, small


def _aimed(angle: float, rate: float, aim: float) -> Callable[[float, float], Section]:
    return _history(((angle, rate, 1.0),), aimed_weights(angle, rate, aim), 0, 1.0)


CANDIDATES = (
    Candidate("paper, as printed", "paper", False, _paper),
    Candidate("paper, window of three signs", "three-signs", False, _three_signs),
    Candidate("paper's coder, tuned", "tuned", True, _tuned),
    Candidate(
        "sign of innovation, Kalman filter", "innovation", True, _aimed(*innovation_gains(), 0.0)
    ),
    Candidate(
        "sign of angle and rate combined", "combined", True, _aimed(AIMED_ANGLE, AIMED_RATE, AIM)
    ),
    Candidate(
        "history, steady range",
        "history-known-q",
        True,
        _history(STEADY_ROWS, STEADY_WEIGHTS, STEADY_LOOKAHEAD, 1.0),
    ),
    Candidate(
        "history, range finds itself",
        "history",
        False,
        _history(FOLLOWING_ROWS, FOLLOWING_WEIGHTS, FOLLOWING_LOOKAHEAD, FOLLOWING_SPAN),
    ),
)
PAPER = "paper"
TUNED = "tuned"
BEST = "history-known-q"

PRESETS = {"tuned-10baud": 10.0, "history-10baud": 10.0, "tuned-20baud": 20.0, "history-20baud": 20.0}
"""bit/s of the presets that are flown as they are, beside the candidates"""
