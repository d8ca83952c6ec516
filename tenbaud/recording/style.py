"""How figures are drawn here: sizes, lines, files."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from tenbaud.files.whole import whole_file
from tenbaud.recording.envelope import Series, thin

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LINE_A = "#1b1b1b"
LINE_B = "#0b6fb8"
LINE_C = "#d9730d"
FAINT = "#8a8a8a"
POINTS = 3000
FIGURE_FORMATS = (".png", ".svg", ".pdf")
UNWRITTEN = {"png": "Software", "svg": "Date", "svgz": "Date", "pdf": "CreationDate"}
"""Left out of a file of these formats: the same data give the same file."""


def new_figure(
    rows: int, height: float = 2.0, ratios: Sequence[float] | None = None, width: float = 8.0
) -> tuple[Figure, list[Axes]]:
    """Return a figure with `rows` panels under each other that share their time axis."""
    from matplotlib.figure import Figure  # takes half a second, which other commands need not pay

    class FlightFigure(Figure):
        """A figure that a notebook shows without a magic command."""

        def _repr_png_(self) -> bytes:
            stream = BytesIO()
            self.savefig(stream, format="png", dpi=72)
            return stream.getvalue()

    figure = FlightFigure(figsize=(width, 0.5 + height * rows), layout="constrained")
    grid = figure.subplots(rows, 1, sharex=True, squeeze=False, height_ratios=ratios)
    panels = [row[0] for row in grid]
    for panel in panels:
        panel.grid(visible=True, color="#e6e6e6", linewidth=0.6)
        panel.set_axisbelow(True)
        panel.spines[["top", "right"]].set_visible(False)
    return figure, panels


def legend_above(panel: Axes, columns: int = 4) -> None:
    """Put the legend, if there is any, above the panel's right end, where no curve is."""
    if panel.get_legend_handles_labels()[0]:
        above = (1.0, 0.97)
        panel.legend(loc="lower right", bbox_to_anchor=above, ncols=columns, fontsize=8, frameon=False)


def decimated(times: Series, values: Series) -> tuple[Series, Series]:
    """Return a curve of few enough points for a small file, its extremes kept."""
    return thin(np.asarray(times), np.asarray(values), POINTS)


def save(figure: Figure, paths: Sequence[Path], dots_per_inch: int = 100) -> None:
    """Write the figure to each path; the ending says in which format."""
    for path in paths:
        style: dict[str, Any] = {"format": path.suffix[1:].lower() or "png"}
        if style["format"] in UNWRITTEN:
            style["metadata"] = {UNWRITTEN[style["format"]]: None}
        with whole_file(path) as stream:
            figure.savefig(stream, dpi=dots_per_inch, **style)


def picture_html(figure: Figure, dots_per_inch: int = 90) -> str:
    """Return a figure as an image in HTML."""
    stream = BytesIO()
    figure.savefig(stream, format="png", dpi=dots_per_inch)
    data = b64encode(stream.getvalue()).decode()
    return f'<img alt="outputs and estimate errors over time" src="data:image/png;base64,{data}">'
