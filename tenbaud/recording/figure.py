"""Draws one flight as the paper draws its Figs. 6 and 7, with the bits below."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from channel.codec.signals import Signal
from channel.line.impairments import parse_impairments
from tenbaud.recording.encoding import OVERVIEW_METADATA, RUN_METADATA, recorded_signals
from tenbaud.recording.envelope import Curve
from tenbaud.recording.errors import RecordingError
from tenbaud.recording.overview import FIELDS, Overview, marks_of, unpacked
from tenbaud.recording.pose import draw_poses, has_poses
from tenbaud.recording.reader import MessageStream, rows_in_blocks, stored_metadata
from tenbaud.recording.style import FAINT, LINE_A, LINE_B, LINE_C, legend_above, new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ERASURE_COLOUR = "#d01c1f"
FLIP_COLOUR = "#8e3fb0"
USUAL_COLOUR = "#f0a000"
REJOIN_COLOUR = "#2a8c4a"
COLOURS = (LINE_B, LINE_C, "#2a8c4a", "#8e3fb0", LINE_A, "#b08a00")
"""Of several outputs or inputs in one panel."""
STEPS = {"drawstyle": "steps-post"}


SHARES_DRAWN = 100
"""Stretches of a flight of which the share of the bits is drawn."""
FLIGHT_DOTS_PER_INCH = 150
DRAWN_MAX = 8
"""Groups of outputs or of inputs that have a panel."""

_Draw = Callable[["Axes", "_Flight"], None]


class _Flight:
    """The contents of the figure: curves and marks of a transmitter, thinned to what can be seen."""

    def __init__(
        self, overview: Overview, theirs: Overview | None, impairments: str, usual: Curve | None
    ) -> None:
        """Raises RecordingError where the transmitter recorded no tick."""
        self.plant = overview.plant
        held = overview.curves
        if theirs is not None and theirs.plant == self.plant:
            held = {**held, "reference": theirs.curves["reference"]}
        self.curves = {name: [one.curve() for one in curves] for name, curves in held.items()}
        """name of a curve -> that of each output, or of each input"""
        times_s = self.curves["value"][0][0] if self.plant.outputs else np.zeros(0)
        if not len(times_s):
            raise RecordingError(
                "The recording holds no ticks: give a transmitter's recording of a flight."
            )
        self.marks = {name: marks_of(one) for name, one in overview.marks.items()}
        self.symbols, self.symbols_are_means = overview.symbols.curve(), overview.symbols.thinned
        means = sorted(overview.means().items())
        shares = [one.curve()[1] for _, one in means if one is not overview.symbols]
        self.about = [] if all(np.isnan(one).all() for one in shares) else shares
        """of each output: which symbols were about it, or their share; nothing where it is not known"""
        self.cuts_s = _cuts(impairments, times_s[-1])
        """times in which nothing was to pass, on purpose"""
        self.usual = usual
        """the first output over 1000 bit/s"""

    @property
    def live_is_coded(self) -> bool:
        """Whether both estimates are one, as without a command lead: one curve hides the other."""
        pairs = zip(self.curves["live"], self.curves["coded"], strict=True)
        return all(np.array_equal(live[1], coded[1], equal_nan=True) for live, coded in pairs)

    def knows(self, name: str, places: list[int]) -> bool:
        """Whether there is any value of a curve."""
        return any(not np.isnan(self.curves[name][place][1]).all() for place in places)


def draw_run(
    transmitter: Path | None,
    receiver: Path | None,
    title: str,
    own: bool = False,
    usual: Curve | None = None,
) -> Figure:
    """Return the figure of a flight. Raises RecordingError where no transmitter recorded a tick.

    An output is the true one where the rig knows it, else the measured one; the errors are taken
    from it. The receiver's recording adds the reference. `usual` is the first output over 1000 bit/s.
    `own`: the recordings were made just now, and what they store for the figure is trusted.
    """
    if transmitter is None:
        raise RecordingError(
            "There is no transmitter's recording here, and what was measured is recorded there. Give "
            "the folder of the transmitter's run."
        )
    overview, metadata = _read_overview(transmitter, own)
    theirs = _read_overview(receiver, own)[0] if receiver is not None else None
    return draw_overviews(overview, theirs, metadata.get("impairments", ""), title, usual)


def draw_overviews(
    overview: Overview, theirs: Overview | None, impairments: str, title: str, usual: Curve | None
) -> Figure:
    """Return the figure of what a transmitter and, if there is one, a receiver recorded.

    Raises RecordingError where the transmitter recorded no tick.
    """
    flight = _Flight(overview, theirs, impairments, usual)
    drawn = _panels(flight)
    ratios = [ratio for ratio, _, _ in drawn]
    height = (0.9 + sum(ratios)) / len(drawn)
    figure, panels = new_figure(len(drawn), height, ratios, width=9.0)
    for number, (panel, (_, label, draw)) in enumerate(zip(panels, drawn, strict=True)):
        draw(panel, flight)
        panel.set_ylabel(label)
        panel.set_title(f"({chr(ord('a') + number)})", loc="left", fontsize=9)
    times_s, _ = flight.curves["value"][0]
    panels[0].set_xlim(times_s[0], max(times_s[-1], 1e-3))
    panels[-1].set_xlabel("time, s")
    figure.suptitle(title, fontsize=11)
    figure.align_ylabels(panels)
    return figure


def _panels(flight: _Flight) -> list[tuple[float, str, _Draw]]:
    """Return the panels, top to bottom: height, label, and drawing function."""
    plant = flight.plant
    outputs = plant.groups("outputs")[:DRAWN_MAX]
    inputs = plant.groups("inputs")[:DRAWN_MAX]
    # Only what the model puts together shares a panel of values; errors and inputs of one unit do too.
    values = [
        shown
        for label, places in outputs
        for shown in (
            [(label, places)]
            if plant.outputs[places[0]].group
            else [(plant.outputs[place].label, [place]) for place in places]
        )
    ][:DRAWN_MAX]
    height = 3.0 if len(values) == 1 else 2.2
    found: list[tuple[float, str, _Draw]] = []
    if has_poses(plant):
        found.append((1.6, "", _draw_poses))
    found += [(height, _plain(label), partial(_draw_values, places=places)) for label, places in values]
    for name, height, curve, draw in (
        ("error", 2.0, "error_coded", _draw_errors),
        (r"range $M_k$", 1.6, "range", partial(_draw_steps, curve="range")),
    ):
        for label, places in outputs:
            if flight.knows(curve, places):
                units = {plant.outputs[place].unit for place in places}
                of_what = f": {label}"
                if len(outputs) == len(units) == 1:
                    of_what = "".join(f", {unit}" for unit in units if unit)
                found.append((height, name + _plain(of_what), partial(draw, places=places)))
    found += [
        (1.4, _plain(label), partial(_draw_steps, curve="applied", places=places))
        for label, places in inputs
        if flight.knows("applied", places)
    ]
    if not flight.symbols_are_means:
        return [*found, (1.0, "bits", _draw_symbols)]
    if flight.about:
        return [*found, (1.0, "share of bits", _draw_shares)]
    return [*found, (1.0, "mean of bits", _draw_symbols)]


def _plain(label: str) -> str:
    """Return a label as matplotlib shows it: a dollar sign would begin an equation."""
    return label.replace("$", r"\$")


def _read_overview(path: Path, own: bool = False) -> tuple[Overview, dict[str, str]]:
    """Return the overview of a recording and what the run said about itself, in one pass over its rows.

    `own`: the recording was made just now, and the overview that it stores is trusted, if it has one.
    """
    stored = stored_metadata(path, (OVERVIEW_METADATA, RUN_METADATA)) if own else {}
    if OVERVIEW_METADATA in stored:
        metadata = stored.get(RUN_METADATA, {})
        found = unpacked(stored[OVERVIEW_METADATA], recorded_signals(metadata))
        if found is not None:
            return found, metadata
    overview = None
    stream = MessageStream(path)
    for block in rows_in_blocks(stream, FIELDS):
        # The head, which says what is recorded, comes before the rows.
        overview = overview or Overview(recorded_signals(stream.metadata.get(RUN_METADATA, {})))
        for topic, (times, rows) in block.items():
            there = {one.name for one in stream.channels[topic].fields}
            names = [name for name in FIELDS[topic] if name in there]
            overview.add(topic, times, {name: [row[name] for row in rows] for name in names})
    metadata = stream.metadata.get(RUN_METADATA, {})
    overview = overview or Overview(recorded_signals(metadata))
    overview.finish()
    return overview, metadata


def _cuts(impairments: str, end_s: float) -> list[tuple[float, float]]:
    try:
        faults = parse_impairments(impairments)
    except ValueError:  # of another version
        return []
    cuts = sorted({*faults.up.cuts, *faults.down.cuts})
    return [(start / 1e9, min(end / 1e9, end_s)) for start, end in cuts if start / 1e9 < end_s]


def _draw_values(panel: Axes, flight: _Flight, places: list[int]) -> None:
    """Draw outputs with their set-points and estimates."""
    # Good estimates lie on the value: only thin lines over a thick one can all be seen.
    kinds = [
        _Kind("reference", "reference", FAINT, 1.1, {"linestyle": "-."}),
        _Kind("value", "", LINE_A, 2.2, {"alpha": 0.5 if len(places) > 1 else 1.0}),
    ]
    if flight.live_is_coded:
        kinds.append(_Kind("coded", "estimate", LINE_B))
    else:
        kinds.append(_Kind("live", "live estimate", LINE_C))
        kinds.append(_Kind("coded", "coded estimate", LINE_B))
    _draw_curves(panel, flight, flight.plant.outputs, places, kinds)
    if flight.usual is not None and 0 in places:
        panel.plot(*flight.usual, "--", color=USUAL_COLOUR, linewidth=1.2, label="over 1000 bit/s")
    for index, (start_s, end_s) in enumerate(flight.cuts_s):
        label = "line cut" if index == 0 else ""
        panel.axvspan(start_s, end_s, color=ERASURE_COLOUR, alpha=0.12, linewidth=0, label=label)
    for name, times_s, colour in (
        ("rejoin", flight.marks["rejoin"], REJOIN_COLOUR),
        ("desync", flight.marks["desync"], ERASURE_COLOUR),
    ):
        if len(times_s):
            low = [0.04] * len(times_s)
            across = panel.get_xaxis_transform()
            style: dict[str, Any] = {
                "color": colour,
                "marker": "^",
                "linestyle": "none",
                "markersize": 5,
            }
            panel.plot(times_s, low, transform=across, clip_on=False, label=name, **style)
    legend_above(panel, 7)


def _draw_poses(panel: Axes, flight: _Flight) -> None:
    draw_poses(panel, flight.plant, flight.curves["value"], flight.curves["coded"])
    legend_above(panel, 7)


def _draw_errors(panel: Axes, flight: _Flight, places: list[int]) -> None:
    kinds = [_Kind("error_coded", "", LINE_B, 0.9)]
    if not flight.live_is_coded:
        kinds.insert(0, _Kind("error_live", "live estimate", LINE_C, 0.9))
    if len(places) == 1:
        name = "estimate" if flight.live_is_coded else "coded estimate"
        kinds = [one._replace(label=f"error of the {one.label or name}") for one in kinds]
    _draw_curves(panel, flight, flight.plant.outputs, places, kinds)
    panel.axhline(0.0, color="#999999", linewidth=0.6)
    legend_above(panel, 7)


def _draw_steps(panel: Axes, flight: _Flight, curve: str, places: list[int]) -> None:
    """Draw ranges or inputs."""
    signals = flight.plant.inputs if curve == "applied" else flight.plant.outputs
    _draw_curves(panel, flight, signals, places, [_Kind(curve, "", LINE_B, 0.9, STEPS)])
    if curve == "range":
        panel.set_ylim(bottom=0.0)
    if len(places) > 1:
        legend_above(panel, 7)


class _Kind(NamedTuple):
    """Curves of one kind, and how they are drawn where only one output or input is."""

    curve: str
    label: str
    """empty: the name of the output or input"""
    colour: str
    width: float = 0.8
    style: Mapping[str, Any] = MappingProxyType({})


def _draw_curves(
    panel: Axes,
    flight: _Flight,
    signals: Sequence[Signal],
    places: list[int],
    kinds: Sequence[_Kind],
) -> None:
    """Draw curves of some outputs or inputs; of several, each in its own colour, live ones dashed."""
    several = len(places) > 1
    for number, place in enumerate(places):
        for kind in kinds:
            times_s, values = flight.curves[kind.curve][place]
            if np.isnan(values).all():
                continue
            style = {"color": kind.colour, "linewidth": kind.width, **kind.style}
            if several:
                style["color"] = COLOURS[number % len(COLOURS)]
                if "live" in kind.curve:
                    style["linestyle"] = "--"
            label = kind.label if number == 0 else ""
            panel.plot(times_s, values, label=label if kind.label else signals[place].words, **style)


def _draw_symbols(panel: Axes, flight: _Flight) -> None:
    times_s, symbols = flight.symbols
    if not flight.symbols_are_means:
        colours: Any = LINE_A
        if flight.about:
            places = np.nan_to_num(np.array(flight.about)).argmax(axis=0)
            colours = np.array(COLOURS)[places % len(COLOURS)]
        panel.vlines(times_s, 0.0, symbols, color=colours, linewidth=0.8)
        _name_outputs(panel, flight)
    else:
        means = np.nan_to_num(symbols)
        panel.fill_between(times_s, means, step="post", color=LINE_A, linewidth=0.0)
    panel.axhline(0.0, color="#999999", linewidth=0.6)
    _draw_faults(panel, flight, -1.0)
    panel.set_ylim(-1.35, 1.35)
    panel.set_yticks([-1.0, 0.0, 1.0])


def _draw_shares(panel: Axes, flight: _Flight) -> None:
    """Draw which share of the symbols was about each output, one above the other."""
    times_s, shares = flight.symbols[0], np.nan_to_num(np.array(flight.about))
    size = max(1, len(times_s) // SHARES_DRAWN)
    count = len(times_s) // size * size
    means = shares[:, :count].reshape(len(shares), -1, size).mean(axis=2)
    colours = [COLOURS[place % len(COLOURS)] for place in range(len(shares))]
    means = np.column_stack((means, means[:, -1]))  # to the end of the flight
    panel.stackplot(
        [*times_s[:count:size], times_s[-1]], means, colors=colours, step="post", linewidth=0.0
    )
    _name_outputs(panel, flight)
    _draw_faults(panel, flight, 0.0)
    panel.set_ylim(0.0, 1.0)


def _name_outputs(panel: Axes, flight: _Flight) -> None:
    """Put the outputs that the symbols were about into the legend."""
    for place, share in enumerate(flight.about):
        label = f"{flight.plant.outputs[place].words} {np.nanmean(share):.0%}"
        panel.plot([], [], color=COLOURS[place % len(COLOURS)], linewidth=3.0, label=label)


def _draw_faults(panel: Axes, flight: _Flight, low: float) -> None:
    for name, colour in (("erased", ERASURE_COLOUR), ("flipped", FLIP_COLOUR)):
        if len(flight.marks[name]):
            panel.vlines(flight.marks[name], low, 1.0, color=colour, linewidth=0.9, label=name)
    legend_above(panel, 7)
