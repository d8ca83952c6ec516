"""Draws one flight as the paper draws its Figs. 6 and 7, with the bits below."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from channel.line.impairments import parse_impairments
from tenbaud.files.whole import whole_file
from tenbaud.recording.encoding import OVERVIEW_METADATA, RUN_METADATA
from tenbaud.recording.envelope import Series
from tenbaud.recording.errors import RecordingError
from tenbaud.recording.overview import (
    FIELDS,
    Columns,
    Overview,
    marks_of,
    unpacked,
)
from tenbaud.recording.reader import MessageStream, rows_in_blocks, stored_metadata
from tenbaud.recording.rows import Row

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PITCH_COLOUR = "#1b1b1b"
REFERENCE_COLOUR = "#8a8a8a"
CODED_COLOUR = "#0b6fb8"
LIVE_COLOUR = "#d9730d"
ERASURE_COLOUR = "#d01c1f"
FLIP_COLOUR = "#8e3fb0"
REJOIN_COLOUR = "#2a8c4a"


@dataclass(frozen=True, slots=True)
class _Flight:
    """The contents of the figure."""

    curves: dict[str, tuple[Series, Series]]
    marks: dict[str, Series]
    symbols: tuple[Series, Series]
    symbols_are_means: bool
    cuts_s: list[tuple[float, float]]
    """times in which nothing was to pass, on purpose"""

    @property
    def live_is_coded(self) -> bool:
        """Whether both estimates are one, as without a command lead: one curve hides the other."""
        return np.array_equal(self.curves["live"][1], self.curves["coded"][1], equal_nan=True)


def draw_flight(transmitter: Path, receiver: Path | None, output: Path, title: str) -> None:
    """Draw the first measured axis of a flight that was just flown into the PNG file `output`.

    The pitch is the true one where the rig knows it, else the measured one; the errors are taken
    from it. The receiver's recording adds the reference. Raises RecordingError if the
    transmitter's recording holds no flight.
    """
    figure = draw_run(transmitter, receiver, title, own=True)
    with whole_file(output) as stream:
        figure.savefig(stream, dpi=150, format="png")


def draw_run(transmitter: Path | None, receiver: Path | None, title: str, own: bool = False) -> Figure:
    """Return the same as a matplotlib figure. Raises RecordingError without a transmitter's file.

    `own`: the recordings were made just now, and what they store for the figure is trusted.
    """
    from matplotlib.figure import Figure  # takes half a second, which other commands need not pay

    if transmitter is None:
        raise RecordingError(
            "There is no transmitter's recording here, and the pitch is recorded there. Give the "
            "folder of the transmitter's run."
        )
    flight = _read_flight(transmitter, receiver, own)
    figure = Figure(figsize=(9.0, 9.0), layout="constrained")
    panels = figure.subplots(4, 1, sharex=True, height_ratios=[3.0, 2.0, 1.6, 1.0])
    _draw_pitch(panels[0], flight)
    _draw_errors(panels[1], flight)
    _draw_range(panels[2], flight)
    _draw_symbols(panels[3], flight)
    for letter, panel in zip("abcd", panels, strict=True):
        panel.set_title(f"({letter})", loc="left", fontsize=9)
        panel.grid(visible=True, color="#e6e6e6", linewidth=0.6)
        panel.set_axisbelow(True)
        panel.spines[["top", "right"]].set_visible(False)
    times_s, _ = flight.curves["pitch"]
    panels[0].set_xlim(times_s[0], max(times_s[-1], 1e-3))
    panels[-1].set_xlabel("time, s")
    figure.suptitle(title, fontsize=11)
    figure.align_ylabels(panels)
    return figure


def _read_flight(transmitter: Path, receiver: Path | None, own: bool) -> _Flight:
    overview, metadata = _read_overview(transmitter, own)
    times_s, _ = overview.curves["pitch"].curve()
    if not len(times_s):
        raise RecordingError(
            f"The recording {transmitter} holds no ticks, so there is no flight to draw. "
            "Give a transmitter's recording."
        )
    if receiver is not None:
        overview.curves["reference"] = _read_overview(receiver, own)[0].curves["reference"]
    return _Flight(
        {name: one.curve() for name, one in overview.curves.items()},
        {name: marks_of(one) for name, one in overview.marks.items()},
        overview.symbols.curve(),
        overview.symbols.thinned,
        _cuts(metadata.get("impairments", ""), times_s[-1]),
    )


def _read_overview(path: Path, own: bool = False) -> tuple[Overview, dict[str, str]]:
    """Return the overview of a recording and what the run said about itself, in one pass over its rows.

    `own`: the recording was made just now, and the overview that it stores is trusted, if it has one.
    """
    stored = stored_metadata(path, (OVERVIEW_METADATA, RUN_METADATA)) if own else {}
    if OVERVIEW_METADATA in stored:
        found = unpacked(stored[OVERVIEW_METADATA])
        if found is not None:
            return found, stored.get(RUN_METADATA, {})
    overview = Overview()
    stream = MessageStream(path)
    for block in rows_in_blocks(stream, FIELDS):
        for topic, (times, rows) in block.items():
            names = {one.name for one in stream.channels[topic].fields}
            overview.add(topic, times, _columns_of(rows, names))
    overview.finish()
    return overview, stream.metadata.get(RUN_METADATA, {})


def _columns_of(rows: Sequence[Row], names: set[str]) -> Columns:
    return lambda name: [row[name] for row in rows] if name in names else None


def _cuts(impairments: str, end_s: float) -> list[tuple[float, float]]:
    try:
        faults = parse_impairments(impairments)
    except ValueError:  # of another version
        return []
    cuts = sorted({*faults.up.cuts, *faults.down.cuts})
    return [(start / 1e9, min(end / 1e9, end_s)) for start, end in cuts if start / 1e9 < end_s]


def _draw_pitch(panel: Axes, flight: _Flight) -> None:
    _plot(
        panel,
        flight.curves["reference"],
        "reference",
        color=REFERENCE_COLOUR,
        linewidth=1.1,
        linestyle="-.",
    )
    # Good estimates lie on the pitch: only thin lines over a thick one can all be seen.
    _plot(panel, flight.curves["pitch"], r"pitch $\theta$", color=PITCH_COLOUR, linewidth=2.2)
    if flight.live_is_coded:
        _plot(panel, flight.curves["coded"], "estimate", color=CODED_COLOUR, linewidth=0.8)
    else:
        _plot(panel, flight.curves["live"], "live estimate", color=LIVE_COLOUR, linewidth=0.8)
        _plot(panel, flight.curves["coded"], "coded estimate", color=CODED_COLOUR, linewidth=0.8)
    for index, (start_s, end_s) in enumerate(flight.cuts_s):
        label = "line cut" if index == 0 else ""
        panel.axvspan(start_s, end_s, color=ERASURE_COLOUR, alpha=0.12, linewidth=0, label=label)
    for name, times_s, colour in (
        ("rejoin", flight.marks["rejoin"], REJOIN_COLOUR),
        ("desync", flight.marks["desync"], ERASURE_COLOUR),
    ):
        if len(times_s):
            places = [0.04] * len(times_s)
            across = panel.get_xaxis_transform()
            style: dict[str, Any] = {
                "color": colour,
                "marker": "^",
                "linestyle": "none",
                "markersize": 5,
            }
            panel.plot(times_s, places, transform=across, clip_on=False, label=name, **style)
    panel.set_ylabel("pitch, rad")
    _legend_above(panel)


def _draw_errors(panel: Axes, flight: _Flight) -> None:
    coded, live = flight.curves["error_coded"], flight.curves["error_live"]
    if flight.live_is_coded:
        _plot(panel, coded, "error of the estimate", color=CODED_COLOUR, linewidth=0.9)
    else:
        _plot(panel, live, "error of the live estimate", color=LIVE_COLOUR, linewidth=0.9)
        _plot(panel, coded, "error of the coded estimate", color=CODED_COLOUR, linewidth=0.9)
    panel.axhline(0.0, color="#999999", linewidth=0.6)
    panel.set_ylabel("error, rad")
    _legend_above(panel)


def _draw_range(panel: Axes, flight: _Flight) -> None:
    _plot(panel, flight.curves["range"], "", color=CODED_COLOUR, linewidth=0.9, drawstyle="steps-post")
    panel.set_ylim(bottom=0.0)
    panel.set_ylabel("range $M_k$, rad")


def _draw_symbols(panel: Axes, flight: _Flight) -> None:
    times_s, symbols = flight.symbols
    if not flight.symbols_are_means:
        label = "bits"
        panel.vlines(times_s, 0.0, symbols, color=PITCH_COLOUR, linewidth=0.8)
    else:
        label = "mean of bits"
        means = np.nan_to_num(symbols)
        panel.fill_between(times_s, means, step="post", color=PITCH_COLOUR, linewidth=0.0)
    panel.axhline(0.0, color="#999999", linewidth=0.6)
    for name, colour in (("erased", ERASURE_COLOUR), ("flipped", FLIP_COLOUR)):
        if len(flight.marks[name]):
            panel.vlines(flight.marks[name], -1.0, 1.0, color=colour, linewidth=0.9, label=name)
    _legend_above(panel)
    panel.set_ylim(-1.35, 1.35)
    panel.set_yticks([-1.0, 0.0, 1.0])
    panel.set_ylabel(label)


def _legend_above(panel: Axes) -> None:
    handles, labels = panel.get_legend_handles_labels()
    if handles:
        panel.legend(
            handles,
            labels,
            loc="lower right",
            bbox_to_anchor=(1.0, 0.98),
            ncols=7,
            frameon=False,
            fontsize=8,
        )


def _plot(panel: Axes, curve: tuple[Series, Series], label: str, **style: Any) -> None:
    if not np.isnan(curve[1]).all():
        panel.plot(*curve, label=label, **style)
