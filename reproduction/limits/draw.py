"""The two pictures of docs/LIMITS.md."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from reproduction.limits.candidates import BEST, CANDIDATES, PAPER
from reproduction.limits.encoder import encoder_floor
from reproduction.limits.flight import FINE_COUNTS, RIG_COUNTS
from reproduction.limits.intervals import ratio
from reproduction.limits.plan import DENSITIES, NOMINAL, RATES, Outcome
from reproduction.limits.tables import estimation, floor_of
from tenbaud.recording.style import FAINT, LINE_A, LINE_B, LINE_C, save

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# The sign of angle and rate combined lies under the two history coders and is left to the table.
CURVES = (
    (PAPER, "the paper's coder", LINE_C, "s"),
    ("tuned", "its coder, tuned", "#c9a400", "D"),
    (BEST, "history, steady range", LINE_B, "o"),
    ("history", "history, range finds itself", "#6a51a3", "v"),
)


def draw_rates(path: Path, outcome: Outcome) -> None:
    """Draw error against rate at the nominal disturbance: floor, paper, ours."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, 4.8), layout="constrained")
    panel = figure.subplots()
    _frame(panel)
    rates = np.geomspace(4.3, 47.0, 30)
    floors = np.array([math.degrees(math.sqrt(floor_of(rate, NOMINAL))) for rate in rates])
    panel.plot(rates, floors, color=LINE_A, linewidth=2.0, label="floor: no code does better")
    panel.fill_between(rates, floors * 1e-3, floors, color="#efefef")
    for key, label, colour, marker in CURVES:
        found = [ratio(estimation(outcome, key, r, NOMINAL, FINE_COUNTS), 1.0) for r in RATES]
        panel.errorbar(
            RATES,
            [math.degrees(one.value) for one in found],
            [math.degrees(one.half) for one in found],
            color=colour,
            marker=marker,
            markersize=5,
            linewidth=1.2,
            capsize=2,
            label=label,
        )
    rounding = math.degrees(encoder_floor(RIG_COUNTS))
    panel.axhline(rounding, color=FAINT, linewidth=1.0, linestyle="--")
    panel.text(4.4, rounding * 1.06, f"rounding of {RIG_COUNTS} counts", color=FAINT, fontsize=8)
    panel.set(xscale="log", yscale="log", xlim=(4.3, 47.0), ylim=(0.007, 18.0))
    panel.set_xticks(RATES, [f"{rate:g}" for rate in RATES])
    panel.set_xticks([], minor=True)
    panel.set(xlabel="bit/s, one bit per sample", ylabel="error of the angle, rms (deg)")
    panel.set_title(f"White torque of {NOMINAL:g} rad²/s³", loc="left", fontsize=10)
    panel.legend(fontsize=8, frameon=False, loc="upper right")
    save(figure, [path])


def draw_disturbances(path: Path, outcome: Outcome) -> None:
    """Draw error over the floor against the strength of the disturbance, at 10 bit/s."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, 3.6), layout="constrained")
    panel = figure.subplots()
    _frame(panel)
    for key, label, colour, marker in CURVES:
        found = [
            ratio(estimation(outcome, key, 10.0, q, FINE_COUNTS), floor_of(10.0, q)) for q in DENSITIES
        ]
        knows_q = next(one for one in CANDIDATES if one.key == key).knows_q
        panel.errorbar(
            DENSITIES,
            [one.value for one in found],
            [one.half for one in found],
            color=colour,
            marker=marker,
            markersize=5,
            linewidth=1.2,
            linestyle="--" if knows_q else "-",
            capsize=2,
            label=label + (" (knows q)" if knows_q else ""),
        )
    panel.axhline(1.0, color=LINE_A, linewidth=1.5)
    panel.set(xscale="log", yscale="log", ylim=(0.9, 400.0))
    panel.set_xticks(DENSITIES, [f"{density:g}" for density in DENSITIES])
    panel.set_yticks([1, 1.5, 2, 3, 5, 10, 30, 100], ["1", "1.5", "2", "3", "5", "10", "30", "100"])
    panel.set_yticks([], minor=True)
    panel.set_xticks([], minor=True)
    panel.set(xlabel="white torque q (rad²/s³)", ylabel="rms error over the floor, 10 bit/s")
    panel.legend(fontsize=8, frameon=False, loc="upper right")
    save(figure, [path])


def _frame(panel: Axes) -> None:
    panel.grid(visible=True, which="major", color="#e6e6e6", linewidth=0.6)
    panel.set_axisbelow(True)
    panel.spines[["top", "right"]].set_visible(False)
