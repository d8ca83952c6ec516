"""The columns of a log as small panels under each other."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tenbaud.log.describe import Description, clock_of
from tenbaud.log.table import Table
from tenbaud.recording.style import LINE_A, LINE_B, decimated, new_figure, save

PANELS_MAX = 24
CLOCKS = ("clock", "index", "empty")


def draw_log(described: Description, table: Table, path: Path) -> None:
    """Draw every column but clocks over time, or over the rows where there is none."""
    times = clock_of(described.suggestion, table)
    shown = [
        (one, table.columns[place])
        for place, one in enumerate(described.looks)
        if one.kind not in CLOCKS
    ][:PANELS_MAX]
    figure, panels = new_figure(max(1, len(shown)), height=1.1)
    over = np.arange(len(table), dtype=np.float64) if times is None else times
    for panel, (one, values) in zip(panels, shown, strict=False):
        taken = described.taken_as.get(one.name, "")
        there = np.isfinite(over)
        curve = decimated(over[there], values[there])
        panel.plot(*curve, color=LINE_B if taken else LINE_A, linewidth=0.9)
        unit = f", {one.unit}{'?' * bool(one.guess)}" if one.unit else ""
        title = f"{one.name}{unit}: {one.words}{f'; taken as {taken}' if taken else ''}"
        panel.set_title(title, loc="left", fontsize=8)
        panel.tick_params(labelsize=7)
    panels[-1].set_xlabel("row" if times is None else "time on the file's clock, s", fontsize=8)
    save(figure, [path])
