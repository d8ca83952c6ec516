"""The pictures of docs/BOTHWAYS.md."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from reproduction.bothways.study import ASKED_SAMPLES, BAUDS, FLIPS, LOSSES, TRIPS, Found, Point
from tenbaud.recording.style import FAINT, save

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ERRORS, LISTS = "figures/bothways-errors.png", "figures/bothways-lists.png"
COLOURS = {10: "#d9730d", 20: "#0b6fb8", 40: "#2e8b57", 100: "#1b1b1b"}
MARKERS = {10: "o", 20: "s", 40: "^", 100: "v"}
SCHEMES = {"announced": ("mirrored law, announced set-points", "-"), "coded": ("coded commands", "--")}
WORST, BEST = 10.0, 0.9
"""error over that of the full downlink, at the edges of the picture"""
Points = dict[Point, Found]


def draw(docs: Path, found: Points) -> None:
    """Draw both pictures, as PNG and SVG."""
    for name, make in ((ERRORS, _errors), (LISTS, _lists)):
        path = docs / name
        make([path, path.with_suffix(".svg")], found)


def _errors(paths: list[Path], found: Points) -> None:
    """Draw the ratio of the estimation errors against loss, flips and round trip, for both schemes."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.4, 5.4), layout="constrained")
    panels = figure.subplots(2, 3, sharey=True, sharex="col")
    for row, (scheme, (name, _)) in zip(panels, SCHEMES.items(), strict=True):
        for panel, axis in zip(row, ("loss", "flip", "trip"), strict=True):
            _prepare(panel)
            panel.axhline(1.0, color=FAINT, linewidth=1.0)
            for baud in BAUDS:
                points = _along(found, scheme, baud, axis)
                scale = 1.0 if axis == "trip" else 100.0
                panel.errorbar(
                    [scale * getattr(one, axis) for one in points],
                    [min(found[one].error, WORST) for one in points],
                    [min(found[one].error_half, WORST) for one in points],
                    color=COLOURS[baud],
                    marker=MARKERS[baud],
                    markersize=4.0,
                    linewidth=1.3,
                    capsize=2,
                    label=f"{baud} down",
                )
            if axis == "trip":
                panel.set_xticks([0, *TRIPS])
            panel.set(yscale="log", ylim=(BEST, 1.1 * WORST))
            panel.set_yticks([1, 1.2, 1.5, 2, 3, 5, 10], ["1", "1.2", "1.5", "2", "3", "5", "10"])
            panel.set_yticks([], minor=True)
        row[0].set_title(name, loc="left", fontsize=10)
        row[0].set_ylabel("error over that of full")
    for panel, label in zip(
        panels[1], ("loss, both ways, %", "flips, both ways, %", "round trip, samples"), strict=True
    ):
        panel.set_xlabel(label)
    panels[0, 2].legend(fontsize=8, frameon=False, loc="upper left", ncols=2)
    save(figure, paths)


def _lists(paths: list[Path], found: Points) -> None:
    """Draw delay, length of the list, CPU and rejoins against loss."""
    from matplotlib.figure import Figure

    wanted: tuple[tuple[str, Callable[[Found], float]], ...] = (
        ("confirmed after, samples (median)", lambda one: one.delay),
        ("copies in the list (mean)", lambda one: one.size),
        ("CPU of the list, % of a core", lambda one: 100.0 * one.cpu),
        ("rejoins an hour", lambda one: one.rejoins_h),
    )
    figure = Figure(figsize=(8.4, 5.4), layout="constrained")
    panels = figure.subplots(2, 2, sharex=True)
    for panel, (label, value) in zip(panels.flat, wanted, strict=True):
        _prepare(panel)
        for scheme, (_, line) in SCHEMES.items():
            for baud in BAUDS:
                points = _along(found, scheme, baud, "loss")
                panel.plot(
                    [100.0 * one.loss for one in points],
                    [value(found[one]) for one in points],
                    color=COLOURS[baud],
                    linestyle=line,
                    marker=MARKERS[baud],
                    markersize=4.0,
                    linewidth=1.3,
                    label=f"{baud} down, {'mirrored' if scheme == 'announced' else 'coded'}",
                )
        panel.set_title(label, loc="left", fontsize=10)
        if not label.startswith("rejoins"):
            panel.set_yscale("log")
            panel.yaxis.set_major_formatter("{x:g}")
            panel.yaxis.set_minor_formatter("")
    panels[1, 1].set_ylim(bottom=0.0)
    for panel in panels[1]:
        panel.set_xlabel("loss, both ways, %")
    handles, labels = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, fontsize=8, frameon=False, ncols=4, loc="outside upper center")
    save(figure, paths)


def _along(found: Points, scheme: str, baud: int, axis: str) -> list[Point]:
    """Return the points of the pitch axis at which only one kind of fault is not zero, in its order."""
    others = [one for one in ("loss", "flip", "trip") if one != axis]
    steps = {"loss": LOSSES, "flip": (0.0, *FLIPS), "trip": (0, *TRIPS)}[axis]
    points = [
        one
        for one in found
        if (one.subject, one.scheme, one.baud) == ("pitch", scheme, baud)
        and one.samples != ASKED_SAMPLES
        and not any(getattr(one, other) for other in others)
        and getattr(one, axis) in steps
    ]
    return sorted(points, key=lambda one: float(getattr(one, axis)))


def _prepare(panel: Axes) -> None:
    panel.grid(visible=True, color="#e6e6e6", linewidth=0.6)
    panel.set_axisbelow(True)
    panel.spines[["top", "right"]].set_visible(False)
