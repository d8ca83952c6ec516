"""The plots of a study: error against each setting that was swept, and a heat map for each pair."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import numpy as np

from tenbaud.studies.settings import StudyError

LABELS = {
    "rate": "R in bit/s",
    "loss": "share of messages lost",
    "flip": "share of symbols flipped",
    "delay": "delay each way in s",
    "mismatch": "plant off the model",
    "density": "torque density q in rad²/s³",
}
QUANTITIES = {
    "error_live_rms": "rms error of what the receiver believed",
    "error_coded_rms": "rms error of the codec",
    "tracking_rms": "rms distance from the reference",
}
MAPS_MAX = 12
"""Pairs beyond these are left out: nobody reads fifty maps."""


def draw_study(table: Any, names: list[str], title: str, folder: Path) -> list[Path]:
    """Draw all plots of a table into a folder; return the files."""
    good = np.array(table["outcome"].to_pylist()) == "ok"
    if not good.any():
        raise StudyError("no flight of this study has figures, so there is nothing to draw")
    columns = {name: np.array(table[name].to_pylist())[good] for name in (*names, *QUANTITIES)}
    numeric = [name for name in names if columns[name].dtype.kind in "fiub"]
    paths = [_curves(columns, name, title, folder) for name in names]
    for first, second in itertools.islice(itertools.combinations(numeric, 2), MAPS_MAX):
        paths.append(_map(columns, first, second, title, folder))
    return paths


def _curves(columns: dict[str, Any], name: str, title: str, folder: Path) -> Path:
    """Draw error quantities against one setting: median and the middle half over everything else."""
    import matplotlib.pyplot as plt

    values = columns[name]
    figure, axes = plt.subplots(figsize=(7.0, 4.4), layout="constrained")
    levels = np.unique(values)
    sampled = values.dtype.kind == "f" and len(levels) > 40
    x = levels if values.dtype.kind in "fiu" else np.arange(len(levels))
    for index, (quantity, label) in enumerate(QUANTITIES.items()):
        errors = np.degrees(columns[quantity])
        if not np.isfinite(errors).any():
            continue
        colour = f"C{index}"
        if sampled:
            axes.plot(values, errors, ".", color=colour, alpha=0.5, markersize=4, label=label)
            continue
        quartiles = np.array([np.nanpercentile(errors[values == one], (25, 50, 75)) for one in levels])
        axes.plot(x, quartiles[:, 1], "o-", color=colour, label=label)
        axes.fill_between(x, quartiles[:, 0], quartiles[:, 2], color=colour, alpha=0.2, linewidth=0)
    if values.dtype.kind not in "fiu":
        axes.set_xticks(x, [str(one) for one in levels])
    elif levels[0] > 0 and levels[-1] >= 5.0 * levels[0]:
        axes.set_xscale("log")
        if len(levels) <= 10:
            axes.set_xticks(levels, [f"{one:.3g}" for one in levels])
            axes.minorticks_off()
    axes.set_yscale("log")
    axes.set_xlabel(LABELS.get(name, name))
    axes.set_ylabel("degrees")
    axes.set_title(title if sampled else f"{title}: median, and the middle half of all flights")
    axes.grid(alpha=0.3)
    axes.legend(loc="best", fontsize=9)
    return _save(figure, folder / f"error_{_file(name)}.png")


def _map(columns: dict[str, Any], first: str, second: str, title: str, folder: Path) -> Path:
    """Draw the median live error over two settings."""
    import matplotlib.pyplot as plt

    quantity = "error_live_rms"
    x, y = columns[first].astype(float), columns[second].astype(float)
    errors = np.degrees(columns[quantity])
    figure, axes = plt.subplots(figsize=(6.4, 4.8), layout="constrained")
    xs, ys = np.unique(x), np.unique(y)
    if len(xs) * len(ys) > len(errors):
        drawn: Any = axes.scatter(x, y, c=errors, cmap="viridis", s=18)
    else:
        grid = np.array([[_median(errors[(x == one) & (y == other)]) for one in xs] for other in ys])
        drawn = axes.pcolormesh(np.arange(len(xs) + 1), np.arange(len(ys) + 1), grid, cmap="viridis")
        axes.set_xticks(np.arange(len(xs)) + 0.5, [f"{one:.3g}" for one in xs])
        axes.set_yticks(np.arange(len(ys)) + 0.5, [f"{one:.3g}" for one in ys])
        for (row, column), value in np.ndenumerate(grid):
            dark = value < 0.5 * (np.nanmin(grid) + np.nanmax(grid))
            axes.text(
                column + 0.5,
                row + 0.5,
                f"{value:.3g}",
                ha="center",
                va="center",
                color="white" if dark else "black",
                fontsize=8,
            )
    figure.colorbar(drawn, ax=axes, label=f"{QUANTITIES[quantity]}, degrees")
    axes.set_xlabel(LABELS.get(first, first))
    axes.set_ylabel(LABELS.get(second, second))
    axes.set_title(title)
    return _save(figure, folder / f"map_{_file(first)}_{_file(second)}.png")


def _median(errors: Any) -> float:
    return float(np.nanmedian(errors)) if len(errors) else float("nan")


def _file(name: str) -> str:
    return name.replace(".", "_")


def _save(figure: Any, path: Path) -> Path:
    import matplotlib.pyplot as plt

    figure.savefig(path, dpi=130)
    plt.close(figure)
    return path
