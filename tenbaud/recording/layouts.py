"""Layouts for Foxglove and PlotJuggler that show a flight at once, from one description of the plots.

Foxglove names a value `topic.field`; PlotJuggler, for JSON messages, `topic/field`. Both say nothing at
all when a name is wrong.
"""

from __future__ import annotations

import json
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple
from xml.etree import ElementTree

from tenbaud.files.whole import write_whole
from tenbaud.recording.signals import output_name

if TYPE_CHECKING:
    from tenbaud.recording.run import Run

TOPIC = "flight"
FOXGLOVE_SUFFIX = ".foxglove.json"
PLOTJUGGLER_SUFFIX = ".plotjuggler.xml"


class Curve(NamedTuple):
    """One curve: a field of the topic `flight`."""

    field: str
    label: str
    colour: str


class Plot(NamedTuple):
    """One panel."""

    title: str
    curves: tuple[Curve, ...]


VALUE, REFERENCE, CODED, LIVE = "#4a4a4a", "#9a9a9a", "#0b6fb8", "#d9730d"
INPUTS = ("#2a8c4a", "#8e3fb0", "#d9730d", "#0b6fb8")

_OF_OUTPUTS = (
    ("{}", (("reference", REFERENCE), ("", VALUE), ("estimate_live", LIVE), ("estimate", CODED))),
    ("error: {}", (("error_live", LIVE), ("error_coded", CODED))),
    ("range M: {}", (("range", CODED),)),
)
"""Title of a panel of outputs -> what it shows of each, by the names of `Run.signals`."""


def flight_plots(run: Run) -> tuple[Plot, ...]:
    """Return the plots of a run converted to one MCAP file, with the signals that it has."""
    plant = run.plant
    shown: list[tuple[str, list[tuple[str, str]]]] = [
        (
            title.format(label),
            [(output_name(plant, what, place), colour) for place in places for what, colour in curves],
        )
        for title, curves in _OF_OUTPUTS
        for label, places in plant.groups("outputs")
    ]
    shown.append(("symbols", [("symbol", VALUE)]))
    for label, places in plant.groups("inputs"):
        names = [plant.inputs[place].name for place in places]
        shown.append((label, list(zip(names, INPUTS * len(names), strict=False))))
    plots = []
    for title, curves in shown:
        found = [(run.signals[name], colour) for name, colour in curves if name in run.signals]
        if found:
            there = [Curve(one.column, one.name, colour) for one, colour in found]
            plots.append(Plot(title, tuple(there)))
    return tuple(plots)


def layout_paths(recording: Path) -> list[Path]:
    """Return where the layouts of a converted file go: Foxglove's, then PlotJuggler's."""
    suffixes = (FOXGLOVE_SUFFIX, PLOTJUGGLER_SUFFIX)
    return [recording.with_name(recording.stem + suffix) for suffix in suffixes]


def flight_layouts(run: Run, recording: Path) -> list[Path]:
    """Write both layouts beside a converted file; return their paths."""
    plots = flight_plots(run)
    foxglove, juggler = layout_paths(recording)
    write_whole(foxglove, foxglove_layout(plots))
    write_whole(juggler, plotjuggler_layout(plots, recording.name))
    return [foxglove, juggler]


def foxglove_layout(plots: tuple[Plot, ...]) -> str:
    """Return a layout that Foxglove and Lichtblick import: the plots below each other."""
    whole, panel, path = json.loads(_template("foxglove.json")).values()
    names = [f"Plot!tenbaud{number}" for number in range(len(plots))]
    for name, plot in zip(names, plots, strict=True):
        paths = [
            path | {"value": f"{TOPIC}.{curve.field}", "label": curve.label, "color": curve.colour}
            for curve in plot.curves
        ]
        titles = {"title": plot.title, "foxglovePanelTitle": plot.title}
        whole["configById"][name] = panel | titles | {"paths": paths}
    layout: Any = names[-1]
    for left, name in enumerate(reversed(names[:-1]), start=1):
        share = {"direction": "column", "splitPercentage": 100.0 / (left + 1)}
        layout = {"first": name, "second": layout, **share}
    return json.dumps(whole | {"layout": layout}, indent=2)


def plotjuggler_layout(plots: tuple[Plot, ...], recording: str) -> str:
    """Return a layout for PlotJuggler 3; `recording` is the file it offers to load, beside it."""
    root = ElementTree.fromstring(_template("plotjuggler.xml"))
    splitter, file = (next(root.iter(name)) for name in ("DockSplitter", "fileInfo"))
    file.set("filename", recording)
    splitter.set("sizes", ";".join([f"{1.0 / len(plots):.6f}"] * len(plots)))
    splitter.set("count", str(len(plots)))
    for plot in plots:
        area = ElementTree.SubElement(splitter, "DockArea", name=plot.title)
        shown = ElementTree.SubElement(area, "plot", mode="TimeSeries", style="Lines")
        for curve in plot.curves:
            ElementTree.SubElement(shown, "curve", name=f"{TOPIC}/{curve.field}", color=curve.colour)
    ElementTree.indent(root, " ")
    text: str = ElementTree.tostring(root, encoding="unicode")
    return f"<?xml version='1.0' encoding='UTF-8'?>\n{text}\n"


def _template(name: str) -> str:
    return (files("tenbaud") / "recording" / "templates" / name).read_text(encoding="utf-8")
