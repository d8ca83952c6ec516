"""Layouts for Foxglove and PlotJuggler that show a flight at once, from one description of the plots.

Foxglove names a value `topic.field`; PlotJuggler, for JSON messages, `topic/field`. Both say nothing at
all when a name is wrong.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple
from xml.etree import ElementTree

from tenbaud.files.whole import write_whole
from tenbaud.recording.signals import output_name

if TYPE_CHECKING:
    from tenbaud.recording.run import Run

FOXGLOVE_SUFFIX = ".foxglove.json"
PLOTJUGGLER_SUFFIX = ".plotjuggler.xml"


class Curve(NamedTuple):
    """One curve: a field of a topic."""

    topic: str
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
            there = [Curve("flight", one.column, one.name, colour) for one, colour in found]
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
    names = [f"Plot!tenbaud{number}" for number in range(len(plots))]
    panels = {name: _foxglove_plot(plot) for name, plot in zip(names, plots, strict=True)}
    layout: Any = names[-1]
    for left, name in enumerate(reversed(names[:-1]), start=1):
        layout = {
            "first": name,
            "second": layout,
            "direction": "column",
            "splitPercentage": 100.0 / (left + 1),
        }
    return json.dumps(
        {
            "configById": panels,
            "globalVariables": {},
            "userNodes": {},
            "playbackConfig": {"speed": 1},
            "layout": layout,
        },
        indent=2,
    )


def _foxglove_plot(plot: Plot) -> dict[str, Any]:
    return {
        "title": plot.title,
        "foxglovePanelTitle": plot.title,
        "paths": [
            {
                "value": f"{curve.topic}.{curve.field}",
                "enabled": True,
                "timestampMethod": "receiveTime",
                "label": curve.label,
                "color": curve.colour,
            }
            for curve in plot.curves
        ],
        "showXAxisLabels": True,
        "showYAxisLabels": True,
        "showLegend": True,
        "legendDisplay": "floating",
        "showPlotValuesInLegend": False,
        "isSynced": True,
        "xAxisVal": "timestamp",
        "sidebarDimension": 240,
    }


def plotjuggler_layout(plots: tuple[Plot, ...], recording: str) -> str:
    """Return a layout for PlotJuggler 3; `recording` is the file it offers to load, beside it."""
    root = ElementTree.Element("root")
    tabs = ElementTree.SubElement(
        root, "tabbed_widget", {"parent": "main_window", "name": "Main Window"}
    )
    tab = ElementTree.SubElement(tabs, "Tab", containers="1", tab_name="flight")
    sizes = ";".join([f"{1.0 / len(plots):.6f}"] * len(plots))
    splitter = ElementTree.SubElement(
        ElementTree.SubElement(tab, "Container"),
        "DockSplitter",
        orientation="-",
        sizes=sizes,
        count=str(len(plots)),
    )
    for plot in plots:
        area = ElementTree.SubElement(splitter, "DockArea", name=plot.title)
        shown = ElementTree.SubElement(area, "plot", mode="TimeSeries", style="Lines")
        for curve in plot.curves:
            name = f"{curve.topic}/{curve.field}"
            ElementTree.SubElement(shown, "curve", name=name, color=curve.colour)
    ElementTree.SubElement(tabs, "currentTabIndex", index="0")
    ElementTree.SubElement(root, "use_relative_time_offset", enabled="1")
    files = ElementTree.SubElement(root, "previouslyLoaded_Datafiles")
    file = ElementTree.SubElement(files, "fileInfo", filename=recording, prefix="")
    topics = sorted({curve.topic for plot in plots for curve in plot.curves})
    ElementTree.SubElement(
        ElementTree.SubElement(file, "plugin", ID="DataLoad MCAP"),
        "parameters",
        use_timestamp="0",
        use_mcap_log_time="1",
        clamp_large_arrays="1",
        max_array_size="100",
        selected_topics=";".join(topics),
    )
    ElementTree.indent(root, " ")
    text: str = ElementTree.tostring(root, encoding="unicode")
    return f"<?xml version='1.0' encoding='UTF-8'?>\n{text}\n"
