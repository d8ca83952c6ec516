"""Layouts for Foxglove and PlotJuggler that show a flight at once, from one description of the plots.

Foxglove names a value `topic.field` or `topic.field[0]`; PlotJuggler, for JSON messages, `topic/field`
or `topic/field[0]`. Both say nothing at all when a name is wrong.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

from tenbaud.files.whole import write_whole

if TYPE_CHECKING:
    from tenbaud.recording.run import Run

FOXGLOVE_SUFFIX = ".foxglove.json"
PLOTJUGGLER_SUFFIX = ".plotjuggler.xml"


@dataclass(frozen=True, slots=True)
class Curve:
    """One curve: a field of a topic, `index` its place in a list; None for a plain number."""

    topic: str
    field: str
    index: int | None
    label: str
    colour: str

    @property
    def place(self) -> str:
        """The index as both tools write it."""
        return "" if self.index is None else f"[{self.index}]"


@dataclass(frozen=True, slots=True)
class Plot:
    """One panel."""

    title: str
    curves: tuple[Curve, ...]


PITCH, REFERENCE, CODED, LIVE = "#4a4a4a", "#9a9a9a", "#0b6fb8", "#d9730d"
FRONT, REAR = "#2a8c4a", "#8e3fb0"

RECORDING_PLOTS = (
    Plot(
        "pitch, rad",
        (
            Curve("tick", "measured", 0, "measured", PITCH),
            Curve("estimate", "coded_state", 0, "coded estimate", CODED),
            Curve("estimate", "live_state", 0, "live estimate", LIVE),
        ),
    ),
    Plot("range M, rad", (Curve("sample", "range", 0, "range", CODED),)),
    Plot(
        "symbols",
        (
            Curve("sample", "word", 0, "consumed", PITCH),
            Curve("sample", "word_sent", 0, "sent", REFERENCE),
        ),
    ),
    Plot(
        "motors, V",
        (
            Curve("tick", "applied", 0, "front", FRONT),
            Curve("tick", "applied", 1, "rear", REAR),
        ),
    ),
    Plot("lateness of the loop, ms", (Curve("tick", "lateness_ms", None, "lateness", LIVE),)),
)
"""For a transmitter's recording as it is."""

_FLIGHT_PLOTS: tuple[tuple[str, tuple[tuple[str, str, str], ...]], ...] = (
    (
        "pitch, rad",
        (
            ("reference", "reference", REFERENCE),
            ("pitch", "pitch", PITCH),
            ("estimate_live", "live estimate", LIVE),
            ("estimate", "coded estimate", CODED),
        ),
    ),
    ("error, rad", (("error_live", "live", LIVE), ("error_coded", "coded", CODED))),
    ("range M, rad", (("range", "range", CODED),)),
    ("symbols", (("symbol", "symbol", PITCH),)),
    ("motors, V", (("front", "front", FRONT), ("rear", "rear", REAR))),
)


def flight_plots(run: Run) -> tuple[Plot, ...]:
    """Return the plots of a run converted to one MCAP file, with the signals that it has."""
    plots = []
    for title, curves in _FLIGHT_PLOTS:
        there = tuple(
            Curve("flight", run.signals[name].column, None, label, colour)
            for name, label, colour in curves
            if name in run.signals
        )
        if there:
            plots.append(Plot(title, there))
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
                "value": f"{curve.topic}.{curve.field}{curve.place}",
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
            name = f"{curve.topic}/{curve.field}{curve.place}"
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
