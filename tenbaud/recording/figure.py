"""Draws one flight as the paper draws its Figs. 6 and 7, with the bits below."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from channel.impairments import parse_impairments
from tenbaud.recording.errors import RecordingError
from tenbaud.recording.reader import Recording
from tenbaud.whole import whole_file

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Series = NDArray[np.float64]

POINTS_PER_CURVE = 4000
SYMBOLS_DRAWN_SINGLY = 1200
"""Beyond these the bits of a flight merge into a solid block; their mean is drawn instead."""

PITCH_COLOUR = "#1b1b1b"
REFERENCE_COLOUR = "#8a8a8a"
CODED_COLOUR = "#0b6fb8"
LIVE_COLOUR = "#d9730d"
ERASURE_COLOUR = "#d01c1f"
FLIP_COLOUR = "#8e3fb0"
REJOIN_COLOUR = "#2a8c4a"


@dataclass(slots=True)
class _Curve:
    """Values over flight time, NaN where there is none."""

    times_s: list[float] = field(default_factory=list)
    values: list[float] = field(default_factory=list)

    def add(self, time_s: float, value: float) -> None:
        self.times_s.append(time_s)
        self.values.append(value)


@dataclass(slots=True)
class _Flight:
    """What the figure shows, read from the recordings."""

    pitch: _Curve = field(default_factory=_Curve)
    reference: _Curve = field(default_factory=_Curve)
    coded: _Curve = field(default_factory=_Curve)
    live: _Curve = field(default_factory=_Curve)
    error_coded: _Curve = field(default_factory=_Curve)
    error_live: _Curve = field(default_factory=_Curve)
    range: _Curve = field(default_factory=_Curve)
    symbols: _Curve = field(default_factory=_Curve)
    erasures_s: list[float] = field(default_factory=list)
    flips_s: list[float] = field(default_factory=list)
    """samples whose word arrived as another one"""
    desyncs_s: list[float] = field(default_factory=list)
    rejoins_s: list[float] = field(default_factory=list)
    cuts_s: list[tuple[float, float]] = field(default_factory=list)
    """times in which nothing was to pass, on purpose"""

    @property
    def live_is_coded(self) -> bool:
        """Whether both estimates are one, as without a command lead: one curve hides the other."""
        return np.array_equal(self.live.values, self.coded.values, equal_nan=True)


def draw_flight(transmitter: Path, receiver: Path | None, output: Path, title: str) -> None:
    """Draw the first measured axis of a flight into the PNG file `output`.

    The pitch is the true one where the rig knows it, else the measured one; the errors are taken
    from it. The receiver's recording adds the reference. Raises RecordingError if the
    transmitter's recording holds no flight.
    """
    figure = draw_run(transmitter, receiver, title)
    with whole_file(output) as stream:
        figure.savefig(stream, dpi=150, format="png")


def draw_run(transmitter: Path | None, receiver: Path | None, title: str) -> Figure:
    """Return the same as a matplotlib figure. Raises RecordingError without a transmitter's file."""
    from matplotlib.figure import Figure  # takes half a second, which other commands need not pay

    if transmitter is None:
        raise RecordingError(
            "There is no transmitter's recording here, and the pitch is recorded there. Give the "
            "folder of the transmitter's run."
        )
    flight = _read_flight(transmitter, receiver)
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
    panels[0].set_xlim(flight.pitch.times_s[0], max(flight.pitch.times_s[-1], 1e-3))
    panels[-1].set_xlabel("time, s")
    figure.suptitle(title, fontsize=11)
    figure.align_ylabels(panels)
    return figure


def _read_flight(transmitter: Path, receiver: Path | None) -> _Flight:
    flight = _Flight()
    recording = Recording(transmitter)
    pitch_of_tick: dict[int, float] = {}
    for time_ns, row in recording.rows("tick"):
        pitch_rad = _first(row.get("true_rad"))
        if np.isnan(pitch_rad):
            pitch_rad = _first(row.get("measured_rad"))
        flight.pitch.add(time_ns / 1e9, pitch_rad)
        pitch_of_tick[row["tick"]] = pitch_rad
    if not flight.pitch.times_s:
        raise RecordingError(
            f"The recording {transmitter} holds no ticks, so there is no flight to draw. "
            "Give a transmitter's recording."
        )
    for time_ns, row in recording.rows("estimate"):
        time_s = time_ns / 1e9
        pitch_rad = pitch_of_tick.get(row["tick"], np.nan)
        coded_rad, live_rad = _first(row.get("coded_state")), _first(row.get("live_state"))
        flight.coded.add(time_s, coded_rad)
        flight.live.add(time_s, live_rad)
        flight.error_coded.add(time_s, pitch_rad - coded_rad)
        flight.error_live.add(time_s, pitch_rad - live_rad)
    _read_samples(recording, flight)
    _read_faults(recording, flight)
    if receiver is not None:
        for time_ns, row in Recording(receiver).rows("tick"):
            flight.reference.add(time_ns / 1e9, _first(row.get("reference_rad")))
    return flight


def _read_samples(recording: Recording, flight: _Flight) -> None:
    words: list[tuple[float, list[float]]] = []
    for time_ns, row in recording.rows("sample"):
        time_s = time_ns / 1e9
        flight.range.add(time_s, _first(row.get("range")))
        if row.get("word") is None:
            flight.erasures_s.append(time_s)
        elif row.get("word_sent") not in (None, row["word"]):
            flight.flips_s.append(time_s)
        words.append((time_s, row.get("word") or [np.nan]))
    for index, (time_s, word) in enumerate(words):
        # The symbols of a word fill its sample period evenly; the last period is not recorded.
        period_s = words[index + 1][0] - time_s if index + 1 < len(words) else 0.0
        for slot, symbol in enumerate(word):
            flight.symbols.add(time_s + period_s * slot / len(word), symbol)


def _read_faults(recording: Recording, flight: _Flight) -> None:
    if "event" in recording.topics:
        for time_ns, row in recording.rows("event"):
            if row.get("kind") == "desync":
                flight.desyncs_s.append(time_ns / 1e9)
            elif row.get("kind") == "rejoin" and "begins" in str(row.get("text")):
                flight.rejoins_s.append(time_ns / 1e9)
    faults = parse_impairments(str(recording.metadata.get("impairments", "")))
    end_s = flight.pitch.times_s[-1]
    for start_ns, end_ns in {*faults.up.cuts, *faults.down.cuts}:
        if start_ns / 1e9 < end_s:
            flight.cuts_s.append((start_ns / 1e9, min(end_ns / 1e9, end_s)))


def _first(value: Any) -> float:
    """The first axis of a recorded number or list of numbers; NaN for null."""
    if isinstance(value, list):
        value = value[0] if value else None
    return float("nan") if value is None else float(value)


def _draw_pitch(panel: Axes, flight: _Flight) -> None:
    _plot(panel, flight.reference, "reference", color=REFERENCE_COLOUR, linewidth=1.1, linestyle="-.")
    # Good estimates lie on the pitch: only thin lines over a thick one can all be seen.
    _plot(panel, flight.pitch, r"pitch $\theta$", color=PITCH_COLOUR, linewidth=2.2)
    if flight.live_is_coded:
        _plot(panel, flight.coded, "estimate", color=CODED_COLOUR, linewidth=0.8)
    else:
        _plot(panel, flight.live, "live estimate", color=LIVE_COLOUR, linewidth=0.8)
        _plot(panel, flight.coded, "coded estimate", color=CODED_COLOUR, linewidth=0.8)
    for index, (start_s, end_s) in enumerate(flight.cuts_s):
        label = "line cut" if index == 0 else ""
        panel.axvspan(start_s, end_s, color=ERASURE_COLOUR, alpha=0.12, linewidth=0, label=label)
    for name, times_s, colour in (
        ("rejoin", flight.rejoins_s, REJOIN_COLOUR),
        ("desync", flight.desyncs_s, ERASURE_COLOUR),
    ):
        if times_s:
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
    if flight.live_is_coded:
        _plot(panel, flight.error_coded, "error of the estimate", color=CODED_COLOUR, linewidth=0.9)
    else:
        _plot(panel, flight.error_live, "error of the live estimate", color=LIVE_COLOUR, linewidth=0.9)
        _plot(
            panel, flight.error_coded, "error of the coded estimate", color=CODED_COLOUR, linewidth=0.9
        )
    panel.axhline(0.0, color="#999999", linewidth=0.6)
    panel.set_ylabel("error, rad")
    _legend_above(panel)


def _draw_range(panel: Axes, flight: _Flight) -> None:
    _plot(panel, flight.range, "", color=CODED_COLOUR, linewidth=0.9, drawstyle="steps-post")
    panel.set_ylim(bottom=0.0)
    panel.set_ylabel("range $M_k$, rad")


def _draw_symbols(panel: Axes, flight: _Flight) -> None:
    times_s, symbols = _arrays(flight.symbols)
    if len(symbols) <= SYMBOLS_DRAWN_SINGLY:
        label = "bits"
        panel.vlines(times_s, 0.0, symbols, color=PITCH_COLOUR, linewidth=0.8)
    else:
        label = "mean of bits"
        times_s, symbols = _bucket_means(times_s, symbols, SYMBOLS_DRAWN_SINGLY)
        panel.fill_between(times_s, symbols, step="post", color=PITCH_COLOUR, linewidth=0.0)
    panel.axhline(0.0, color="#999999", linewidth=0.6)
    erasures_s = np.unique(flight.erasures_s[:: 1 + len(flight.erasures_s) // POINTS_PER_CURVE])
    if len(erasures_s):
        panel.vlines(erasures_s, -1.0, 1.0, color=ERASURE_COLOUR, linewidth=0.9, label="erased")
    if flight.flips_s:
        flips_s = flight.flips_s[:: 1 + len(flight.flips_s) // POINTS_PER_CURVE]
        panel.vlines(flips_s, -1.0, 1.0, color=FLIP_COLOUR, linewidth=0.9, label="flipped")
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


def _plot(panel: Axes, curve: _Curve, label: str, **style: Any) -> None:
    times_s, values = interrupt_gaps(*_arrays(curve))
    if np.isnan(values).all():
        return
    panel.plot(*decimate(times_s, values, POINTS_PER_CURVE), label=label, **style)


def _arrays(curve: _Curve) -> tuple[Series, Series]:
    return np.array(curve.times_s, dtype=np.float64), np.array(curve.values, dtype=np.float64)


def interrupt_gaps(times: Series, values: Series) -> tuple[Series, Series]:
    """Put a NaN into every gap of more than five usual steps, where rows were lost or none came.

    Without it a straight line would pass for a flight.
    """
    if len(times) < 3:
        return times, values
    steps = np.diff(times)
    after = np.flatnonzero(steps > 5.0 * np.median(steps)) + 1
    return np.insert(times, after, times[after - 1]), np.insert(values, after, np.nan)


def decimate(times: Series, values: Series, points: int) -> tuple[Series, Series]:
    """Thin a curve to at most `points` points, keeping each bucket's lowest and highest.

    A bucket with a NaN keeps one, so that the curve stays interrupted there; such a bucket may have
    three points.
    """
    if len(values) <= points:
        return times, values
    kept: list[int] = []
    edges = np.linspace(0, len(values), points // 2 + 1).astype(int)
    for start, end in pairwise(edges):
        bucket = values[start:end]
        if np.isnan(bucket).all():
            kept.append(int(start))
            continue
        chosen = {int(start + np.nanargmin(bucket)), int(start + np.nanargmax(bucket))}
        gaps = np.flatnonzero(np.isnan(bucket))
        if len(gaps):
            chosen.add(int(start + gaps[0]))
        kept.extend(sorted(chosen))
    return times[kept], values[kept]


def _bucket_means(times: Series, values: Series, buckets: int) -> tuple[Series, Series]:
    edges = np.linspace(0, len(values), buckets + 1).astype(int)[:-1]
    known = ~np.isnan(values)
    sums = np.add.reduceat(np.where(known, values, 0.0), edges)
    counts = np.add.reduceat(known.astype(np.float64), edges)
    return times[edges], sums / np.maximum(counts, 1.0)
