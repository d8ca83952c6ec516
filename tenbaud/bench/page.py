"""Writes docs/LIMITS.md from what was flown. No number in its tables is typed in by hand."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from pathlib import Path

from tenbaud.bench.entrants import ENTRANTS
from tenbaud.bench.flight import FINE_COUNTS, RIG_COUNTS
from tenbaud.bench.plan import DENSITIES, NOMINAL, RATES, Outcome, Ratio, exponent, ratio
from tenbaud.bench.recorded import Row
from tenbaud.bench.tracking import DISTURBANCES, PRESETS, USUAL
from tenbaud.bench.trials import TRIALS, fly_trial
from tenbaud.limits.encoder import (
    double_integrator_rate_at_encoder_floor,
    encoder_floor,
    floor_behind_encoder,
)
from tenbaud.limits.floor import DOUBLE_INTEGRATOR, WIENER, floor, word_floor
from tenbaud.limits.linear import integrators, linear_model, pitch, rate_needed

PICTURE = "figures/limits.png"
DISTURBANCE_PICTURE = "figures/limits-disturbance.png"


def write_page(path: Path, outcome: Outcome, recorded: Sequence[Row], quick: bool) -> None:
    """Write the page."""
    path.write_text("\n".join(_lines(outcome, recorded, quick)), encoding="utf-8")


def estimation(outcome: Outcome, entrant: str, rate: float, density: float, counts: int) -> list[float]:
    """Return the mean squares of one cell, estimation only."""
    return [one.estimation for one in outcome.flights[(entrant, rate, density, False, counts)]]


def floor_of(rate: float, density: float) -> float:
    """Return the floor that the table divides by: that of the pitch at rest."""
    return floor(pitch(density), rate)


def _lines(outcome: Outcome, recorded: Sequence[Row], quick: bool) -> list[str]:
    scale = outcome.scale
    flag = " --quick" if quick else ""
    return [
        "# How near the limit",
        "",
        "What R bit/s are worth at best, what the paper's coder makes of them, and what this project's"
        " does.",
        "This page and its pictures are written by",
        "",
        "```",
        f"tenbaud bench coders{flag} --docs docs --data ../shared/data",
        "```",
        "",
        "and no number in its tables is typed in by hand. `+-` is half of a 95 % interval over the"
        " seeds,",
        "which are the same for every coder.",
        "",
        f"![Error against rate]({PICTURE})",
        "",
        *_floors(),
        *_estimation(outcome),
        *_encoder(outcome),
        *_closed(outcome),
        *_tracking(outcome),
        *_recorded(recorded),
        *_coders(),
        "## How it was flown",
        "",
        f"Estimation only: {scale.seeds} seeds of {scale.seconds:g} s, of which the first 10 s do not"
        " count; the paper's plant, exactly",
        "the codec's model, under white torque, motors off. Closed loop: the paper's controller and"
        " reference,",
        f"{scale.closed_seeds} seeds of {scale.closed_seconds:g} s, the first 25 s left out. Words are"
        " there at the instant of their sample",
        '(`delivery = "start"`, command lead 0), one bit per sample on the fixed grid, and no'
        " information in their",
        "timing. The flights join the nodes' own parts without the protocol around them; a test holds"
        " that the errors",
        "are the same to the last bit as those of both sessions in memory.",
        "",
    ]


def _table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    lines = ["| " + " | ".join(header) + " |", "|" + "---|" * len(header)]
    return [*lines, *("| " + " | ".join(row) + " |" for row in rows), ""]


def _degrees(mean_square: float) -> str:
    return f"{math.degrees(math.sqrt(mean_square)):.3g} deg"


def _floors() -> list[str]:
    pendulum = linear_model([[0.0, 1.0], [7.3198**2, 0.0]], [[0.0, 0.0], [0.0, 2e-3]], [1.0, 0.0])
    double = integrators(2, NOMINAL)
    rows = [
        (
            f"{rate:g}",
            _degrees(floor(double, rate)),
            _degrees(floor(pitch(NOMINAL), rate)),
            _degrees(word_floor(pitch(NOMINAL), 1.0, 1.0 / rate)),
            _degrees(floor(pitch(NOMINAL), rate, erased=0.3)),
            _degrees(floor_behind_encoder(NOMINAL, rate, RIG_COUNTS, 0.01)),
        )
        for rate in RATES
    ]
    at_encoder = ", ".join(
        f"{double_integrator_rate_at_encoder_floor(density, RIG_COUNTS):.1f} bit/s for q = {density:g}"
        for density in DENSITIES
    )
    return [
        "## The floors",
        "",
        "For a linear plant under white noise no causal code of R bit/s, whatever it computes, has a"
        " smaller mean",
        "square error than the *floor*, as long as nothing is read from the moments at which bits"
        " arrive. For the Wiener",
        f"process it is {WIENER:.3f} q/R, for an angle under white torque of density q"
        f" {DOUBLE_INTEGRATOR:.3f} q/R^3",
        "(rad^2, q in rad^2/s^3); for any other linear model `tenbaud.limits.floor` solves the convex"
        " problem. Root",
        f"mean square, q = {NOMINAL:g}:",
        "",
        *_table(
            (
                "bit/s",
                "double integrator",
                "pitch (2)",
                "pitch, one bit at a time",
                "pitch, 30 % of the bits lost",
                f"double integrator, {RIG_COUNTS} counts",
            ),
            rows,
        ),
        f"The rounding of {RIG_COUNTS} counts a turn is"
        f" {math.degrees(encoder_floor(RIG_COUNTS)):.4f} deg rms. An ideal code is as exact at"
        f" {at_encoder};",
        "more bits than that are spent on the encoder's steps. The last column takes rounding for white"
        " noise: a yardstick, no bound.",
        "The body at rest needs no bit at all to be followed (its modes decay); a pendulum of 7.32 1/s"
        " needs more than",
        f"{rate_needed(pendulum.dynamics):.2f} bit/s, and asking `floor` for less says so.",
        "",
    ]


def _estimation(outcome: Outcome) -> list[str]:
    header = ("coder", *(f"{rate:g} bit/s" for rate in RATES), "exponent")
    lines = [
        "## Coders over the floor: estimation",
        "",
        "Root mean square error over the floor of the pitch, the angle known exactly at the transmitter."
        " The exponent is",
        "that of the error against R; the theory says -1.5. *Told* coders know q, the others do not.",
        "",
    ]
    for density in DENSITIES:
        lines += [f"q = {density:g} rad^2/s^3:", ""]
        rows = []
        for entrant in ENTRANTS:
            squares = [estimation(outcome, entrant.key, rate, density, FINE_COUNTS) for rate in RATES]
            cells = [
                str(ratio(one, floor_of(rate, density)))
                for one, rate in zip(squares, RATES, strict=True)
            ]
            slope = exponent(list(RATES), squares) if _all_finite(squares) else Ratio(math.inf, 0.0)
            rows.append((_name(entrant.key), *cells, str(slope)))
        lines += _table(header, rows)
    return [*lines, f"![Error against disturbance]({DISTURBANCE_PICTURE})", ""]


def _all_finite(squares: list[list[float]]) -> bool:
    return all(math.isfinite(value) for one in squares for value in one)


def _name(key: str) -> str:
    entrant = next(one for one in ENTRANTS if one.key == key)
    return entrant.name + (" (told)" if entrant.told else "")


def _encoder(outcome: Outcome) -> list[str]:
    rows = []
    for entrant in ENTRANTS:
        cells = []
        for rate in RATES:
            squares = estimation(outcome, entrant.key, rate, NOMINAL, RIG_COUNTS)
            tick_s = 0.01 if rate <= 20.0 else 0.2 / rate
            behind = floor_behind_encoder(NOMINAL, rate, RIG_COUNTS, tick_s)
            plain = ratio(squares, floor_of(rate, NOMINAL))
            cells.append(f"{plain} / {ratio(squares, behind).value:.2f}")
        rows.append((_name(entrant.key), *cells))
    return [
        f"## The same behind the rig's encoder of {RIG_COUNTS} counts",
        "",
        f"q = {NOMINAL:g}. Over the floor of the pitch / over the yardstick that knows of the encoder."
        " From about 20 bit/s on the encoder",
        "is what limits; rates come from the transmitter's observer, which smooths the counts.",
        "",
        *_table(("coder", *(f"{rate:g} bit/s" for rate in RATES)), rows),
    ]


def _closed(outcome: Outcome) -> list[str]:
    lines = [
        "## Coders over the floor: closed loop",
        "",
        "The same error while the paper's controller flies its square wave on what it is told.",
        "",
    ]
    for density in DENSITIES:
        rows = []
        for entrant in ENTRANTS:
            cells = [
                str(
                    ratio(
                        [
                            one.estimation
                            for one in outcome.flights[(entrant.key, rate, density, True, FINE_COUNTS)]
                        ],
                        floor_of(rate, density),
                    )
                )
                for rate in RATES
            ]
            rows.append((_name(entrant.key), *cells))
        lines += [f"q = {density:g} rad^2/s^3:", ""]
        lines += _table(("coder", *(f"{rate:g} bit/s" for rate in RATES)), rows)
    return lines


def _tracking(outcome: Outcome) -> list[str]:
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
    return [
        "## Does the loop notice?",
        "",
        "Distance from the paper's reference, root mean square over all eight plants 10 % off the model,"
        " and that over",
        "the usual loop's, a ten-bit word at every tick, taken to be there at once. The encoder has 4096"
        " counts in all.",
        "",
        *_table(("loop", "no torque", "white torque, q = 2e-3"), rows),
        "It does not, and cannot: the square wave's jumps, which the body takes seconds to follow, are"
        " nearly all of that distance.",
        "",
    ]


def _recorded(recorded: Sequence[Row]) -> list[str]:
    if not recorded:
        return ["## Recorded flights", "", "They were left out: give their folder with --data.", ""]
    rows = [
        (
            row.recording,
            row.rate,
            f"{100.0 * row.paper_type.rms:.2f} % / {100.0 * row.paper_type.largest:.1f} %",
            f"{100.0 * row.history.rms:.2f} % / {100.0 * row.history.largest:.1f} %",
            f"{100.0 * row.gain:.0f} % less",
        )
        for row in recorded
    ]
    return [
        "## Recorded flights",
        "",
        "Rms / largest error as fractions of the largest pitch. For the UIUC recording both coders were"
        " tuned on its first",
        "half, at each rate, and are judged on the second; for the history coder the first half was"
        " played at one, two and",
        "three times its size, for the second one's shoves are harder. Nothing was tuned on the NTNU"
        " recordings.",
        "A few shoves make up most of these errors: moving the sample phase by a tick moves the rms of the"
        " history coder by",
        "some tenths of its value, so the last column has that spread.",
        "",
        *_table(
            ("recording", "rate", "paper's coder, tuned", "history coder", "rms error"),
            rows,
        ),
    ]


def _coders() -> list[str]:
    tried = [(trial.name, f"{trial.bits:.3f}", f"{fly_trial(trial):.2f}") for trial in TRIALS]
    return [
        "## What the coders do",
        "",
        "* **Paper**: the sign of the angle's error, held over the sample; the range grows after equal"
        " signs (19). *Tuned*: corrections",
        "  at once and a range that hardly moves, the best of this kind under steady white torque.",
        "* **Sign of innovation, Kalman filter**: the same bit with the gains of the filter that takes"
        " it for what it is.",
        "* **Sign of angle and rate combined**: the transmitter sees the rate in its full-rate encoder, so"
        " the bit may ask for",
        "  the sign of `angle error + 1.46 T rate error`, where the angle will be in a while. Most of the"
        " gain is here, for",
        "  two gains and no memory. It is the history coder with one row.",
        "* **History**: what a sign corrects depends on the three before it (a table of eight rows); the"
        " transmitter",
        "  chooses the sign by looking ahead through what the receiver will make of it. The table is the"
        " cheap form of a Bayesian",
        "  quantiser: each row is the mean of the posterior after that pattern. With growing and shrinking"
        " rows the range finds",
        "  itself, whatever the disturbance. `channel/coders/history.py`, presets `history-10baud`,"
        " `history-20baud`.",
        "",
        "Tried on the double integrator and not kept, rms over the floor of the rate that they pay for:",
        "",
        *_table(("word", "bits paid", "rms over the floor"), tried),
        "Silence is a symbol on a fixed grid and costs as much as the two signs beside it; two bits at a"
        " time wait twice as long.",
        "",
    ]
