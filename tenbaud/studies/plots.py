"""The plots of a study: error against each setting that was swept, and a heat map for each pair."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import numpy as np

from tenbaud.studies.settings import StudyError

LABELS = {
    "rate": "R in symbols per second (baud)",
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
COLOURS = {"error_coded_rms": "C0", "error_live_rms": "C1", "tracking_rms": "C2"}
LEVELS_MAX = 40
"""A setting with more values than these was sampled, and is drawn as dots."""
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
    """Draw the errors, and below them the tracking, against one setting."""
    import matplotlib.pyplot as plt

    values = columns[name]
    levels = np.unique(values)
    sampled = values.dtype.kind == "f" and len(levels) > LEVELS_MAX
    figure, (upper, lower) = plt.subplots(
        2, 1, figsize=(7.0, 5.4), layout="constrained", sharex=True, height_ratios=(3, 1)
    )
    for axes, quantities in (
        (upper, ("error_coded_rms", "error_live_rms")),
        (lower, ("tracking_rms",)),
    ):
        for quantity in quantities:
            _quantity(axes, values, columns[quantity], quantity, sampled)
        axes.set_ylabel("degrees")
        axes.grid(alpha=0.3)
        if axes.lines:
            axes.legend(loc="best", fontsize=9)
    upper.set_yscale("log")
    upper.yaxis.set_major_formatter("{x:g}")
    upper.yaxis.set_minor_formatter("{x:g}")
    if values.dtype.kind not in "fiu":
        lower.set_xticks(np.arange(len(levels)), [str(one) for one in levels])
    elif _spans(levels):
        lower.set_xscale("log")
        if not sampled and len(levels) <= 10:
            lower.set_xticks(levels, [f"{one:.3g}" for one in levels])
            lower.minorticks_off()
    lower.set_xlabel(LABELS.get(name, name))
    what = "each dot a flight" if sampled else "medians, and the middle half of all flights"
    upper.set_title(f"{title}\n{what}", fontsize=10)
    return _save(figure, folder / f"error_{_file(name)}.png")


def _quantity(axes: Any, values: Any, errors: Any, quantity: str, sampled: bool) -> None:
    errors = np.degrees(errors)
    if not np.isfinite(errors).any():
        return
    live = quantity == "error_live_rms"
    colour, label = COLOURS[quantity], QUANTITIES[quantity]
    if sampled:
        axes.plot(values, errors, "." if live else "+", color=colour, markersize=4, label=label)
        return
    levels = np.unique(values)
    x = levels if values.dtype.kind in "fiu" else np.arange(len(levels))
    quartiles = np.array([np.nanpercentile(errors[values == one], (25, 50, 75)) for one in levels])
    axes.plot(x, quartiles[:, 1], "o--" if live else "o-", color=colour, label=label)
    axes.fill_between(x, quartiles[:, 0], quartiles[:, 2], color=colour, alpha=0.15, linewidth=0)


def _spans(levels: Any) -> bool:
    """Return whether values want a log scale."""
    return bool(levels[0] > 0 and levels[-1] >= 5.0 * levels[0])


def _map(columns: dict[str, Any], first: str, second: str, title: str, folder: Path) -> Path:
    """Draw the median live error over two settings."""
    import matplotlib.pyplot as plt
    from matplotlib.colors import LogNorm

    quantity = "error_live_rms"
    x, y = columns[first].astype(float), columns[second].astype(float)
    errors = np.degrees(columns[quantity])
    figure, axes = plt.subplots(figsize=(6.4, 4.8), layout="constrained")
    xs, ys = np.unique(x), np.unique(y)
    if len(xs) * len(ys) > len(errors):
        drawn: Any = axes.scatter(x, y, c=errors, cmap="viridis", s=18, norm=LogNorm())
        for levels, scale in ((xs, axes.set_xscale), (ys, axes.set_yscale)):
            if _spans(levels):
                scale("log")
    else:
        grid = np.array([[_median(errors[(x == one) & (y == other)]) for one in xs] for other in ys])
        drawn = axes.pcolormesh(
            np.arange(len(xs) + 1), np.arange(len(ys) + 1), grid, cmap="viridis", norm=LogNorm()
        )
        axes.set_xticks(np.arange(len(xs)) + 0.5, [f"{one:.3g}" for one in xs])
        axes.set_yticks(np.arange(len(ys)) + 0.5, [f"{one:.3g}" for one in ys])
        for (row, column), value in np.ndenumerate(grid):
            dark = value * value < np.nanmin(grid) * np.nanmax(grid)
            axes.text(
                column + 0.5,
                row + 0.5,
                f"{value:.3g}",
                ha="center",
                va="center",
                color="white" if dark else "black",
                fontsize=8,
            )
    bar = figure.colorbar(drawn, ax=axes, label=f"{QUANTITIES[quantity]}, degrees")
    for axis in (bar.ax.yaxis.set_major_formatter, bar.ax.yaxis.set_minor_formatter):
        axis("{x:g}")
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
