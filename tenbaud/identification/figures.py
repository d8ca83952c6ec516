"""Figs. 3 and 4 of the paper: the excitation of the plant, and the convergence of the estimates."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from plant_sim.identification.filters import Array
from plant_sim.identification.regression import Regression
from plant_sim.identification.structures import PitchStructure
from tenbaud.identification.run import Identified
from tenbaud.recording.style import LINE_A, LINE_B, decimated, legend_above, new_figure, save

PITCH_ORDER = (1, 2, 0)
"""a_th, k_v and a_w, as in the paper"""
PANELS_MAX = 8


def draw_excitation(runs: Sequence[Identified], paths: Sequence[Path]) -> None:
    """Fig. 3: the output (solid) and the filtered input (dash-dotted), a panel per experiment."""
    figure, panels = new_figure(len(runs), height=2.3)
    for panel, letter, one in zip(panels, "abcdef", runs, strict=False):
        record, regression = one.record, one.found.regression
        pitch = isinstance(one.found.structure, PitchStructure)
        names = (r"pitch $\theta$, rad", r"input $\mu_f$, V")
        if not pitch:
            names = (_named(record.output_names[0], record.output_units[0]), "filtered input")
        every = max(1, len(record) // 20_000)
        times = record.step_s * np.arange(0, len(record), every, dtype=np.float64)
        panel.plot(*decimated(times, record.outputs[::every, 0]), color=LINE_A, label=names[0])
        panel.plot(
            *decimated(regression.times_s, regression.filtered_input),
            color=LINE_B,
            linestyle="-.",
            label=names[1],
        )
        panel.set_ylabel(r"$\theta$, rad; $\mu_f$, V" if pitch else names[0])
        panel.set_title(f"({letter}) {one.name}", loc="left", fontsize=9)
        legend_above(panel)
    panels[-1].set_xlabel("time, s")
    save(figure, paths)


def _named(name: str, unit: str) -> str:
    return f"{name}, {unit}" if unit else name


def history_of(regression: Regression, rows: Sequence[int]) -> Array:
    """Return the reported parameters at rows of the history."""
    nothing = np.zeros_like(regression.covariance)
    return np.array(
        [
            [item.value for item in regression.structure.parameters(regression.values_at(row), nothing)]
            for row in rows
        ]
    )


def draw_estimates(
    runs: Sequence[Identified], paths: Sequence[Path], true: Sequence[float] | None = None
) -> None:
    """Fig. 4: the estimates over time, one line style per experiment; `true` where it is known."""
    shown = runs[0].found.parameters
    pitch = isinstance(runs[0].found.structure, PitchStructure)
    columns = PITCH_ORDER if pitch else tuple(range(min(len(shown), PANELS_MAX)))
    labels = [_named(shown[column].letter, shown[column].unit) for column in columns]
    if pitch:
        labels = [r"$\hat a_\theta$, 1/s$^2$", r"$\hat k_v$, 1/(V s$^2$)", r"$\hat a_\omega$, 1/s"]
    figure, panels = new_figure(len(columns), height=1.9)
    histories = []
    for one in runs:
        regression = one.found.regression
        rows = np.unique(np.linspace(0, len(regression.times_s) - 1, 2000).astype(int))
        histories.append((regression.times_s[rows], history_of(regression, rows.tolist())))
    for panel, column, label in zip(panels, columns, labels, strict=True):
        if true is not None:
            panel.axhline(true[column], color="#999999", linewidth=0.8, label="true")
        lasting = max(abs(values[-1, column]) for _, values in histories)
        for (times, values), letter, style in zip(
            histories, "abcdef", ("-", "-.", "--", ":"), strict=False
        ):
            colour = LINE_A if style == "-" else LINE_B
            panel.plot(times, values[:, column], color=colour, linestyle=style, label=letter)
        low = min(0.0, *(2.0 * min(0.0, values[-1, column]) for _, values in histories))
        panel.set_ylim(low - 0.1 * lasting, 2.0 * lasting + 1e-6)
        panel.set_ylabel(label)
    legend_above(panels[0])
    panels[-1].set_xlabel("time, s")
    save(figure, paths)
