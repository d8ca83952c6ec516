"""The tables of docs/LIMITS.md, from what was flown."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from reproduction.limits.candidates import CANDIDATES, PRESETS, TUNED, Candidate
from reproduction.limits.encoder import floor_behind_encoder
from reproduction.limits.flight import FINE_COUNTS, RIG_COUNTS, tick_of
from reproduction.limits.intervals import exponent, paired, ratio
from reproduction.limits.models import integrators, pitch
from reproduction.limits.plan import DENSITIES, NOMINAL, RATES, Outcome
from reproduction.limits.recorded import Row
from reproduction.limits.tracking import DISTURBANCES, USUAL
from reproduction.limits.tracking import PRESETS as LOOPS
from reproduction.limits.trials import TRIALS, fly_trial
from tenbaud.bounds.floor import floor, word_floor


def estimation(
    outcome: Outcome, candidate: str, rate: float, density: float, counts: int
) -> list[float]:
    """Return the mean squares of one cell, estimation only."""
    return [one.estimation for one in outcome.flights[(candidate, rate, density, False, counts)]]


def floor_of(rate: float, density: float) -> float:
    """Return the floor that the table divides by: that of the pitch at rest."""
    return floor(pitch(density), rate)


def _table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = ["| " + " | ".join(header) + " |", "|" + "---|" * len(header)]
    return "\n".join([*lines, *("| " + " | ".join(row) + " |" for row in rows)])


RATE_HEADER = ("coder", *(f"{rate:g} bit/s" for rate in RATES))


def floors_table() -> str:
    """Return the floors at each rate."""
    double, body = integrators(2, NOMINAL), pitch(NOMINAL)
    rows = [
        (
            f"{rate:g}",
            _degrees(floor(double, rate)),
            _degrees(floor(body, rate)),
            _degrees(word_floor(body, 1.0, 1.0 / rate)),
            _degrees(floor(body, 0.7 * rate)),
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


def estimation_table(outcome: Outcome, density: float) -> str:
    """Return every coder over the floor at one disturbance, with the exponent."""
    rows = []
    for candidate in CANDIDATES:
        squares = [estimation(outcome, candidate.key, rate, density, FINE_COUNTS) for rate in RATES]
        cells = [
            str(ratio(one, floor_of(rate, density))) for one, rate in zip(squares, RATES, strict=True)
        ]
        finite = all(math.isfinite(value) for one in squares for value in one)
        rows.append((_name(candidate), *cells, str(exponent(list(RATES), squares)) if finite else "-"))
    table = _table((*RATE_HEADER, "exponent"), rows)
    return f"q = {density:g} rad^2/s^3:\n\n{table}"


def pairs_table(outcome: Outcome) -> str:
    """Return every other coder over the paper's kind, seed by seed, at the nominal disturbance."""
    rows = []
    for candidate in CANDIDATES:
        if candidate.key == TUNED:
            continue
        cells = []
        for rate in RATES:
            own, other = (
                estimation(outcome, key, rate, NOMINAL, FINE_COUNTS) for key in (candidate.key, TUNED)
            )
            cells.append(str(paired(own, other)))
        rows.append((_name(candidate), *cells))
    return _table(RATE_HEADER, rows)


def presets_table(outcome: Outcome) -> str:
    """Return the presets over the floor of their rate: angle exact / behind the rig's encoder."""
    rows = []
    for preset, rate in PRESETS.items():
        cells = []
        for density in DENSITIES:
            exact, rig = (
                ratio(estimation(outcome, preset, rate, density, counts), floor_of(rate, density))
                for counts in (FINE_COUNTS, RIG_COUNTS)
            )
            cells.append(f"{exact} / {rig.value:.2f}")
        rows.append((f"`{preset}`", *cells))
    return _table(("preset", *(f"q = {density:g}" for density in DENSITIES)), rows)


def _name(candidate: Candidate) -> str:
    return candidate.name + (", knows q" if candidate.knows_q else "")


def encoder_table(outcome: Outcome) -> str:
    """Return every coder behind the rig's encoder: over the floor / over the yardstick."""
    rows = []
    for candidate in CANDIDATES:
        cells = []
        for rate in RATES:
            squares = estimation(outcome, candidate.key, rate, NOMINAL, RIG_COUNTS)
            behind = floor_behind_encoder(NOMINAL, rate, RIG_COUNTS, tick_of(rate))
            plain = ratio(squares, floor_of(rate, NOMINAL))
            cells.append(f"{plain} / {ratio(squares, behind).value:.2f}")
        rows.append((_name(candidate), *cells))
    return _table(RATE_HEADER, rows)


def closed_table(outcome: Outcome, density: float) -> str:
    """Return every coder over the floor in the closed loop."""
    rows = []
    for candidate in CANDIDATES:
        cells = []
        for rate in RATES:
            flown = outcome.flights[(candidate.key, rate, density, True, FINE_COUNTS)]
            cells.append(str(ratio([one.estimation for one in flown], floor_of(rate, density))))
        rows.append((_name(candidate), *cells))
    return f"q = {density:g} rad^2/s^3:\n\n{_table(RATE_HEADER, rows)}"


def tracking_table(outcome: Outcome) -> str:
    """Return the loops' distance from the reference."""
    rows = []
    for loop in LOOPS:
        cells = []
        for disturbance in DISTURBANCES:
            squares = outcome.tracking[f"{loop}|{disturbance}"]
            usual = outcome.tracking[f"{USUAL}|{disturbance}"]
            rms = math.sqrt(sum(squares) / len(squares))
            share = rms / math.sqrt(sum(usual) / len(usual))
            cells.append(f"{rms:.4f} rad, x {share:.4f}")
        rows.append((loop, *cells))
    return _table(("loop", "no torque", "white torque, q = 2e-3"), rows)


def recorded_table(recorded: Sequence[Row]) -> str:
    """Return both coders on each recording, side by side."""
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
    return _table(header, rows)


def tried_table() -> str:
    """Return the words that were tried and not kept."""
    rows = [(one.name, f"{one.bits:.3f}", f"{fly_trial(one):.2f}") for one in TRIALS]
    return _table(("word", "bits paid", "rms over the floor"), rows)


def _degrees(mean_square: float) -> str:
    return f"{math.degrees(math.sqrt(mean_square)):.3g} deg"
