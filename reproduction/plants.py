"""Draws docs/figures/plants.png, a flight of every plant: `python -m reproduction.plants`."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tenbaud.flight.fly import fly
from tenbaud.recording.run import Run
from tenbaud.recording.style import LINE_A, LINE_B, LINE_C, decimated, legend_above, save

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PICTURE = Path("docs") / "figures" / "plants.png"
COLORS = (LINE_A, LINE_B, LINE_C)
WHITE = {"transmitter.plant.disturbance": "q=2e-3"}
FLIGHTS = {
    "tuned-10baud": ("pitch", 50.0, WHITE),
    "helicopter-10baud": ("helicopter", 60.0, {}),
    "pendulum-30baud": ("pendulum", 20.0, WHITE),
    "furuta-50baud": ("furuta", 30.0, {}),
    "servo-10baud": ("servo", 20.0, {}),
    "aero-20baud": ("aero", 40.0, {}),
    "integrator-10baud": ("integrator", 30.0, {}),
    "heading-1baud": ("heading", 400.0, {}),
}
"""Preset to the plant's name, the flight's seconds, and settings beside the preset."""


def main() -> None:
    """Fly and draw."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.0, 2.9 * len(FLIGHTS) / 2), layout="constrained")
    pairs = figure.subplots(len(FLIGHTS), 2, height_ratios=[2.2, 1.0] * (len(FLIGHTS) // 2))
    for number, (preset, (plant, seconds, settings)) in enumerate(FLIGHTS.items()):
        row, column = divmod(number, 2)
        panels = pairs[2 * row, column], pairs[2 * row + 1, column]
        with tempfile.TemporaryDirectory() as folder:
            given = {"duration_s": seconds, **settings}
            run = fly(preset, settings=given, out=Path(folder) / "run")
            draw(run, f"{plant}, {run.config.channel.rate_baud:g} baud", *panels)
    save(figure, [PICTURE])


def draw(run: Run, title: str, outputs: Axes, errors: Axes) -> None:
    """Draw the outputs with their set-points and predicted estimates, and the errors of these."""
    several = len(run.plant.outputs) > 1
    for output, color in zip(run.plant.outputs, COLORS, strict=False):
        name = output.name
        for signal, style, label in (
            (f"reference_{name}" if several else "reference", ":", None),
            (f"estimate_live_{name}" if several else "estimate_live", "--", None),
            (name, "-", output.words),
        ):
            if signal in run.signals and np.isfinite(run.signals[signal].values).any():
                one = run.signals[signal]
                curve = decimated(run.time_s, one.values)
                outputs.plot(*curve, style, color=color, linewidth=1.0, label=label)
        error = run.signals[f"error_live_{name}" if several else "error_live"]
        curve = decimated(run.time_s, error.values)
        errors.plot(*curve, color=color, linewidth=0.7)
    outputs.set_title(title, loc="left", fontsize=10, fontweight="bold")
    legend_above(outputs)
    outputs.set_ylabel(run.plant.outputs[0].unit)
    errors.set_ylabel("error")
    errors.set_xlabel("time, s")
    for panel in (outputs, errors):
        panel.grid(visible=True, color="#e6e6e6", linewidth=0.6)
        panel.spines[["top", "right"]].set_visible(False)
        panel.set_xlim(0.0, None)


if __name__ == "__main__":
    main()
