"""Writes docs/LIMITS.md from what was flown. No number in its tables is typed in by hand."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

from reproduction.limits import tables
from reproduction.limits.candidates import AIM
from reproduction.limits.encoder import (
    double_integrator_rate_at_encoder_floor,
    encoder_floor,
    floor_behind_encoder,
)
from reproduction.limits.flight import FINE_COUNTS, PERIOD_S, RIG_COUNTS, SETTLE_S, tick_of
from reproduction.limits.intervals import exponent, ratio
from reproduction.limits.page_template import NOT_RECORDED, PAGE, RECORDED, SUMMARY
from reproduction.limits.plan import DENSITIES, NOMINAL, RATES, Outcome
from reproduction.limits.recorded import Row
from tenbaud.bounds.closed import DOUBLE_INTEGRATOR, WIENER
from tenbaud.bounds.linear import linear_model, rate_needed
from tenbaud.files.whole import write_whole

PICTURE = "figures/limits.png"
DISTURBANCE_PICTURE = "figures/limits-disturbance.png"


def write_page(path: Path, outcome: Outcome, recorded: Sequence[Row], quick: bool) -> None:
    """Write the page."""
    pendulum = linear_model([[0.0, 1.0], [7.3198**2, 0.0]], [[0.0, 0.0], [0.0, 2e-3]], [1.0, 0.0])
    text = PAGE.format(
        flag=" --quick" if quick else "",
        picture=PICTURE,
        disturbance_picture=DISTURBANCE_PICTURE,
        summary=_summary(outcome),
        wiener=WIENER,
        double=DOUBLE_INTEGRATOR,
        nominal=NOMINAL,
        floors=tables.floors_table(),
        counts=RIG_COUNTS,
        rounding=math.degrees(encoder_floor(RIG_COUNTS)),
        at_encoder=", ".join(
            f"{double_integrator_rate_at_encoder_floor(q, RIG_COUNTS):.1f} bit/s for q = {q:g}"
            for q in DENSITIES
        ),
        pendulum=rate_needed(pendulum.dynamics),
        floor_exponent=exponent(RATES, [[tables.floor_of(rate, NOMINAL)] for rate in RATES]).value,
        estimation="\n\n".join(tables.estimation_table(outcome, density) for density in DENSITIES),
        encoder=tables.encoder_table(outcome),
        closed="\n\n".join(tables.closed_table(outcome, density) for density in DENSITIES),
        tracking=tables.tracking_table(outcome),
        recorded=RECORDED.format(table=tables.recorded_table(recorded)) if recorded else NOT_RECORDED,
        pairs=tables.pairs_table(outcome),
        presets=tables.presets_table(outcome),
        aim=AIM,
        behind_20=_over_floor_behind(20.0),
        settle=SETTLE_S,
        period=PERIOD_S,
        tried=tables.tried_table(),
        seeds=outcome.scale.seeds,
        seconds=outcome.scale.seconds,
        closed_seeds=outcome.scale.closed_seeds,
        closed_seconds=outcome.scale.closed_seconds,
    )
    write_whole(path, text)


def _summary(outcome: Outcome) -> str:
    found = {
        f"{key}{suffix}": ratio(
            tables.estimation(outcome, candidate, rate, NOMINAL, FINE_COUNTS),
            tables.floor_of(rate, NOMINAL),
        ).value
        for key, candidate in (
            ("paper", "paper"),
            ("tuned", "tuned"),
            ("knows_q", "history-known-q"),
            ("found", "history"),
        )
        for suffix, rate in (("", 10.0), ("_20", 20.0))
    }
    return SUMMARY.format(**found)


def _over_floor_behind(rate_bit_s: float) -> float:
    """Return the yardstick behind the encoder over the floor, as rms."""
    behind = floor_behind_encoder(NOMINAL, rate_bit_s, RIG_COUNTS, tick_of(rate_bit_s))
    return math.sqrt(behind / tables.floor_of(rate_bit_s, NOMINAL))
