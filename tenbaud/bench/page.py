"""Writes docs/LIMITS.md from what was flown. No number in its tables is typed in by hand."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from pathlib import Path

from tenbaud.bench.entrants import ENTRANTS, Entrant
from tenbaud.bench.flight import FINE_COUNTS, RIG_COUNTS, tick_of
from tenbaud.bench.plan import DENSITIES, NOMINAL, RATES, Outcome, exponent, ratio
from tenbaud.bench.prose import NOT_RECORDED, PAGE, RECORDED, SUMMARY
from tenbaud.bench.recorded import Row
from tenbaud.bench.tracking import DISTURBANCES, PRESETS, USUAL
from tenbaud.bench.trials import TRIALS, fly_trial
from tenbaud.limits.closed import DOUBLE_INTEGRATOR, WIENER
from tenbaud.limits.encoder import (
    double_integrator_rate_at_encoder_floor,
    encoder_floor,
    floor_behind_encoder,
)
from tenbaud.limits.floor import floor, word_floor
from tenbaud.limits.linear import integrators, linear_model, pitch, rate_needed

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
        floors=_floors(),
        counts=RIG_COUNTS,
        rounding=math.degrees(encoder_floor(RIG_COUNTS)),
        at_encoder=", ".join(
            f"{double_integrator_rate_at_encoder_floor(q, RIG_COUNTS):.1f} bit/s for q = {q:g}"
            for q in DENSITIES
        ),
        pendulum=rate_needed(pendulum.dynamics),
        floor_exponent=exponent(list(RATES), [[floor_of(rate, NOMINAL)] for rate in RATES]).value,
        estimation="\n\n".join(_estimation(outcome, density) for density in DENSITIES),
        encoder=_encoder(outcome),
        closed="\n\n".join(_closed(outcome, density) for density in DENSITIES),
        tracking=_tracking(outcome),
        recorded=_recorded(recorded),
        tried=_tried(),
        seeds=outcome.scale.seeds,
        seconds=outcome.scale.seconds,
        closed_seeds=outcome.scale.closed_seeds,
        closed_seconds=outcome.scale.closed_seconds,
    )
    path.write_text(text, encoding="utf-8")


def estimation(outcome: Outcome, entrant: str, rate: float, density: float, counts: int) -> list[float]:
    """Return the mean squares of one cell, estimation only."""
    return [one.estimation for one in outcome.flights[(entrant, rate, density, False, counts)]]


def floor_of(rate: float, density: float) -> float:
    """Return the floor that the table divides by: that of the pitch at rest."""
    return floor(pitch(density), rate)


def _table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = ["| " + " | ".join(header) + " |", "|" + "---|" * len(header)]
    return "\n".join([*lines, *("| " + " | ".join(row) + " |" for row in rows)])


RATE_HEADER = ("coder", *(f"{rate:g} bit/s" for rate in RATES))


def _summary(outcome: Outcome) -> str:
    found = {
        f"{key}{suffix}": ratio(
            estimation(outcome, entrant, rate, NOMINAL, FINE_COUNTS), floor_of(rate, NOMINAL)
        ).value
        for key, entrant in (
            ("paper", "paper"),
            ("tuned", "tuned"),
            ("told", "history-told"),
            ("found", "history"),
        )
        for suffix, rate in (("", 10.0), ("_20", 20.0))
    }
    return SUMMARY.format(**found)


def _floors() -> str:
    double, body = integrators(2, NOMINAL), pitch(NOMINAL)
    rows = [
        (
            f"{rate:g}",
            _degrees(floor(double, rate)),
            _degrees(floor(body, rate)),
            _degrees(word_floor(body, 1.0, 1.0 / rate)),
            _degrees(floor(body, rate, erased=0.3)),
            _degrees(floor_behind_encoder(NOMINAL, rate, RIG_COUNTS, tick_of(rate))),
        )
        for rate in RATES
    ]
    return _table(
        (
            "bit/s",
            "double integrator",
            "pitch (2)",
            "pitch, one bit at a time",
            "pitch, 30 % of the bits lost",
            f"double integrator, {RIG_COUNTS} counts",
        ),
        rows,
    )


def _estimation(outcome: Outcome, density: float) -> str:
    rows = []
    for entrant in ENTRANTS:
        squares = [estimation(outcome, entrant.key, rate, density, FINE_COUNTS) for rate in RATES]
        cells = [
            str(ratio(one, floor_of(rate, density))) for one, rate in zip(squares, RATES, strict=True)
        ]
        finite = all(math.isfinite(value) for one in squares for value in one)
        rows.append((_name(entrant), *cells, str(exponent(list(RATES), squares)) if finite else "-"))
    table = _table((*RATE_HEADER, "exponent"), rows)
    return f"q = {density:g} rad^2/s^3:\n\n{table}"


def _name(entrant: Entrant) -> str:
    return entrant.name + (", told" if entrant.told else "")


def _encoder(outcome: Outcome) -> str:
    rows = []
    for entrant in ENTRANTS:
        cells = []
        for rate in RATES:
            squares = estimation(outcome, entrant.key, rate, NOMINAL, RIG_COUNTS)
            behind = floor_behind_encoder(NOMINAL, rate, RIG_COUNTS, tick_of(rate))
            plain = ratio(squares, floor_of(rate, NOMINAL))
            cells.append(f"{plain} / {ratio(squares, behind).value:.2f}")
        rows.append((_name(entrant), *cells))
    return _table(RATE_HEADER, rows)


def _closed(outcome: Outcome, density: float) -> str:
    rows = []
    for entrant in ENTRANTS:
        cells = []
        for rate in RATES:
            flown = outcome.flights[(entrant.key, rate, density, True, FINE_COUNTS)]
            cells.append(str(ratio([one.estimation for one in flown], floor_of(rate, density))))
        rows.append((_name(entrant), *cells))
    return f"q = {density:g} rad^2/s^3:\n\n{_table(RATE_HEADER, rows)}"


def _tracking(outcome: Outcome) -> str:
    rows = []
    for loop in PRESETS:
        cells = []
        for disturbance in DISTURBANCES:
            squares = outcome.tracking[f"{loop}|{disturbance}"]
            usual = outcome.tracking[f"{USUAL}|{disturbance}"]
            rms = math.sqrt(sum(squares) / len(squares))
            share = rms / math.sqrt(sum(usual) / len(usual))
            cells.append(f"{rms:.4f} rad, x {share:.4f}")
        rows.append((loop, *cells))
    return _table(("loop", "no torque", "white torque, q = 2e-3"), rows)


def _recorded(recorded: Sequence[Row]) -> str:
    if not recorded:
        return NOT_RECORDED
    rows = [
        (
            row.recording,
            row.rate,
            f"{100.0 * row.paper_type.rms:.2f} % / {100.0 * row.paper_type.largest:.1f} %",
            f"{100.0 * row.history.rms:.2f} % / {100.0 * row.history.largest:.1f} %",
            f"{100.0 * abs(row.gain):.0f} % {'less' if row.gain > 0.0 else 'more'}",
        )
        for row in recorded
    ]
    header = ("recording", "rate", "paper's coder, tuned", "history coder", "rms error")
    return RECORDED.format(table=_table(header, rows))


def _tried() -> str:
    rows = [(one.name, f"{one.bits:.3f}", f"{fly_trial(one):.2f}") for one in TRIALS]
    return _table(("word", "bits paid", "rms over the floor"), rows)


def _degrees(mean_square: float) -> str:
    return f"{math.degrees(math.sqrt(mean_square)):.3g} deg"
