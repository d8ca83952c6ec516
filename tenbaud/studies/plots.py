"""The plots of a study: error against each setting that was swept, and a heat map for each pair."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from channel.codec.signals import Signal
from tenbaud.files.whole import whole_file

ANGLE = Signal("output", "rad")

LABELS = {
    "rate": "R in symbols per second (baud)",
    "loss": "share of messages lost",
    "flip": "share of symbols flipped",
    "delay": "delay each way in s",
    "mismatch": "plant off the model",
    "density": "torque density q in rad²/s³",
}
QUANTITIES = {
    "error_live_rms": "rms error of the receiver's predicted estimate",
    "error_coded_rms": "rms error of the codec",
    "tracking_rms": "rms distance from the reference",
}
COLOURS = {"error_coded_rms": "C0", "error_live_rms": "C1", "tracking_rms": "C2"}
LEVELS_MAX = 40
"""A setting with more values than these was sampled, and is drawn as dots."""
CHARACTERS_MAX = 60
"""This many characters of labels have room side by side."""
LABELLED_MAX = 12
"""This many levels of a setting have room for a label each."""
MAPS_MAX = 12
"""Pairs beyond these are left out: nobody reads fifty maps."""


class Drawn(NamedTuple):
    """The common data of one output's plots."""

    columns: dict[str, Any]
    """settings, and the quantities in `unit`"""
    over: list[str]
    """settings with several values, and seeds, where there are several flights of one setting"""
    unit: str
    title: str
    folder: Path
    end: str
    """of the names of its files"""


def draw_study(
    table: Any, names: list[str], title: str, folder: Path, outputs: Sequence[Signal] = (ANGLE,)
) -> list[Path]:
    """Draw all plots of a table into a folder; return the files, none where no flight has figures.

    Every output has plots of its own.

    A setting with one value has none, unless all have one. The title says how many flights have no
    figures, and so are in none of the medians.
    """
    good = np.array(table["outcome"].to_pylist()) == "ok"
    if not good.any():
        return []
    columns = {name: np.array(table[name].to_pylist())[good] for name in names}
    if missing := int(np.count_nonzero(~good)):
        title = f"{title}\n{missing} of {len(good)} flights have no figures and are left out"
    names = [name for name in names if len(np.unique(columns[name])) > 1] or names
    numeric = [name for name in names if columns[name].dtype.kind in "fiub"]
    over = [name for name in names if len(np.unique(columns[name])) > 1]
    if len(set(zip(*columns.values(), strict=True))) < np.count_nonzero(good):
        over.append("seeds")
    paths = []
    for place, output in enumerate(outputs):
        end = f"_{output.name}" if place else ""
        scale = np.degrees(1.0) if output.unit == "rad" else 1.0
        found = {one: scale * np.array(table[one + end].to_pylist())[good] for one in QUANTITIES}
        unit = "degrees" if output.unit == "rad" else output.unit
        whose = f"{title}: {output.words}" if len(outputs) > 1 else title
        drawn = Drawn(columns | found, over, unit, whose, folder, end)
        paths += [_curves(drawn, name) for name in names]
        for first, second in itertools.islice(itertools.combinations(numeric, 2), MAPS_MAX):
            paths.append(_map(drawn, first, second))
    return paths


def _curves(drawn: Drawn, name: str) -> Path:
    """Draw the errors, and below them the tracking, against one setting."""
    import matplotlib.pyplot as plt

    values = drawn.columns[name]
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
            _quantity(axes, values, drawn.columns[quantity], quantity, sampled)
        axes.set_ylabel(drawn.unit)
        axes.grid(alpha=0.3)
        if axes.lines:
            axes.legend(loc="best", fontsize=9)
    upper.set_yscale("log")
    _label_decades(upper.yaxis, *upper.get_ylim())
    if values.dtype.kind not in "fiu":
        texts = [str(one) for one in levels]
        lower.set_xticks(np.arange(len(levels)), texts)
        if sum(len(text) for text in texts) > CHARACTERS_MAX:
            lower.tick_params(axis="x", labelrotation=20)
    elif values.dtype.kind in "iu" and len(levels) <= LABELLED_MAX and not _spans(levels):
        lower.set_xticks(levels)
    elif _spans(levels):
        lower.set_xscale("log")
        if not sampled and len(levels) <= 10:
            lower.set_xticks(levels, [f"{one:.4g}" for one in levels])
            lower.minorticks_off()
    lower.set_xlabel(LABELS.get(name, name))
    others = " and ".join(one for one in drawn.over if one != name)
    what = f"medians, and the middle half over {others}" if others else "one flight for each value"
    what = "each dot a flight" if sampled else what
    upper.set_title(f"{drawn.title}\n{what}", fontsize=10)
    return _save(figure, drawn.folder / f"error_{_file(name)}{drawn.end}.png")


def _quantity(axes: Any, values: Any, errors: Any, quantity: str, sampled: bool) -> None:
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


def _map(of: Drawn, first: str, second: str) -> Path:
    """Draw the median live error over two settings."""
    import matplotlib.pyplot as plt
    from matplotlib.colors import LogNorm

    quantity = "error_live_rms"
    x, y = of.columns[first].astype(float), of.columns[second].astype(float)
    errors = of.columns[quantity]
    figure, axes = plt.subplots(figsize=(6.4, 4.8), layout="constrained")
    xs, ys = np.unique(x), np.unique(y)
    places = np.unique(np.column_stack((x, y)), axis=0)
    if len(places) < len(xs) * len(ys) or max(len(xs), len(ys)) > LEVELS_MAX:
        medians = [_median(errors[(x == one) & (y == other)]) for one, other in places]
        drawn: Any = axes.scatter(
            places[:, 0], places[:, 1], c=medians, cmap="viridis", s=18, norm=LogNorm()
        )
        for levels, scale in ((xs, axes.set_xscale), (ys, axes.set_yscale)):
            if _spans(levels):
                scale("log")
    else:
        grid = np.array([[_median(errors[(x == one) & (y == other)]) for one in xs] for other in ys])
        drawn = axes.pcolormesh(
            np.arange(len(xs) + 1), np.arange(len(ys) + 1), grid, cmap="viridis", norm=LogNorm()
        )
        for levels, set_ticks in ((xs, axes.set_xticks), (ys, axes.set_yticks)):
            shown = np.arange(0, len(levels), -(-len(levels) // LABELLED_MAX))
            set_ticks(shown + 0.5, [f"{levels[index]:.4g}" for index in shown])
        if max(grid.shape) <= LABELLED_MAX:
            _write_medians(axes, grid)
    bar = figure.colorbar(drawn, ax=axes, label=f"{QUANTITIES[quantity]}, {of.unit}")
    _label_decades(bar.ax.yaxis, drawn.norm.vmin, drawn.norm.vmax)
    axes.set_xlabel(LABELS.get(first, first))
    axes.set_ylabel(LABELS.get(second, second))
    axes.set_title(of.title)
    return _save(figure, of.folder / f"map_{_file(first)}_{_file(second)}{of.end}.png")


def _write_medians(axes: Any, grid: Any) -> None:
    """Write each number into its cell, so that it can be read on the cell's colour."""
    middle = np.nanmin(grid) * np.nanmax(grid)
    for (row, column), value in np.ndenumerate(grid):
        text = f"{value:.0f}" if value >= 1000.0 else f"{value:.3g}"
        colour = "white" if value * value < middle else "black"
        axes.text(column + 0.5, row + 0.5, text, ha="center", va="center", color=colour, fontsize=8)


def _label_decades(axis: Any, low: float, high: float) -> None:
    """Label a log axis with as many numbers as there is room for."""
    from matplotlib.ticker import LogLocator, NullFormatter

    span = high / low
    subs = (1.0,) if span > 1000.0 else (1.0, 2.0, 5.0) if span > 5.0 else tuple(range(1, 10))
    axis.set_major_locator(LogLocator(subs=subs, numticks=20))
    axis.set_major_formatter("{x:g}")
    axis.set_minor_formatter(NullFormatter())


def _median(errors: Any) -> float:
    return float(np.nanmedian(errors)) if len(errors) else float("nan")


def _file(name: str) -> str:
    return name.replace(".", "_")


def _save(figure: Any, path: Path) -> Path:
    import matplotlib.pyplot as plt

    with whole_file(path) as stream:
        figure.savefig(stream, dpi=130, format="png")
    plt.close(figure)
    return path
