"""Draws outputs, set-points and errors of one run or of several over each other."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from tenbaud.recording.figure import COLOURS
from tenbaud.recording.signals import output_name
from tenbaud.recording.style import FAINT, LINE_C, decimated, legend_above, new_figure
from tenbaud.sentences.quantities import in_degrees

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

    from tenbaud.recording.recorded import RecordedRun

DASHES = ("-", "--")


def draw_outputs(
    runs: Sequence[tuple[str, RecordedRun]], outputs: Sequence[str], end_s: float, size: float = 1.0
) -> Figure:
    """Return a figure with a panel for each output and one for its live error, up to a flight time.

    `runs` have labels; of a single one the live estimate is drawn too. `size` 1 is eight inches wide.
    """
    figure, panels = new_figure(
        2 * len(outputs), 1.9 * size, [1.5, 1.0] * len(outputs), width=8.0 * size
    )
    for place, name in enumerate(outputs):
        values, errors = panels[2 * place : 2 * place + 2]
        for number, (label, run) in enumerate(runs):
            at = [one.name for one in run.plant.outputs].index(name)
            unit = run.plant.outputs[at].unit
            style = {
                "color": COLOURS[number % len(COLOURS)],
                "linestyle": DASHES[number // len(COLOURS) % len(DASHES)],
                # Runs that are alike lie on each other: only thinner lines over thicker ones show all.
                "linewidth": 2.4 - 1.4 * number / max(1, len(runs) - 1),
                "label": label,
            }
            if number == 0:
                dashed = {"color": FAINT, "linestyle": "-.", "linewidth": 0.9, "label": "set-point"}
                _draw(values, run, output_name(run.plant, "reference", at), unit, end_s, dashed)
                shown = in_degrees(0.0, unit)[1]
                values.set_ylabel(", ".join(filter(None, (run.plant.outputs[at].words, shown))))
                errors.set_ylabel(", ".join(filter(None, ("error", shown))))
            _draw(values, run, output_name(run.plant, "", at), unit, end_s, style)
            if len(runs) == 1:
                estimate = {"color": LINE_C, "linewidth": 0.8, "label": "live estimate"}
                _draw(values, run, output_name(run.plant, "estimate_live", at), unit, end_s, estimate)
            error = {"color": style["color"], "linestyle": style["linestyle"], "linewidth": 0.9}
            _draw(errors, run, output_name(run.plant, "error_live", at), unit, end_s, error)
        # The smallest errors are in front.
        for order, line in enumerate(sorted(errors.lines, key=_size, reverse=True)):
            line.set_zorder(2.0 + 0.01 * order)
        errors.axhline(0.0, color="#999999", linewidth=0.6)
        legend_above(values, 7)
    panels[-1].set_xlabel("time, s")
    panels[-1].set_xlim(0.0, max(end_s, 1e-3))
    figure.align_ylabels(panels)
    return figure


def _size(line: Line2D) -> float:
    return float(np.nanmax(np.abs(np.asarray(line.get_ydata())), initial=0.0))


def _draw(
    panel: Axes, run: RecordedRun, name: str, unit: str, end_s: float, style: dict[str, object]
) -> None:
    """Draw a signal, if the run has it, angles in degrees."""
    signal = run.signal(name)
    if signal is not None:
        inside = run.time_s <= end_s + run.base.tick_s / 2.0
        factor = in_degrees(1.0, unit)[0]
        times, values = decimated(run.time_s[inside], factor * signal.values[inside])
        panel.plot(times, np.asarray(values), **style)  # type: ignore[arg-type]
