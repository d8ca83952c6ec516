"""Several runs side by side: errors, tracking, step responses and bits, over the time they share."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from html import escape
from itertools import pairwise
from pathlib import Path
from string import ascii_uppercase
from typing import TYPE_CHECKING, Any

import numpy as np

from tenbaud.files.whole import make_folder
from tenbaud.recording.errors import RecordingError
from tenbaud.recording.metrics import OutputMetrics, RunMetrics
from tenbaud.recording.run import Run
from tenbaud.recording.signals import output_name
from tenbaud.recording.steps import SETTLING_BAND
from tenbaud.sentences.flown import value_text, verdict_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

RUNS_MAX = 12
"""More curves in one panel are not legible."""
REFERENCE_POINTS, REFERENCE_SHARE = 500, 0.05
"""Set-points differ if they do at more than this share of the moments that are looked at."""
GAP = 2
"""Spaces between columns."""
NOTHING = "-"


@dataclass(frozen=True, slots=True, repr=False)
class SideBySide:
    """What `compare` found. Printed it is a table; a notebook shows table and figure."""

    runs: tuple[Run, ...]
    outputs: tuple[str, ...]
    """the outputs, by name and unit, that all runs have"""
    notes: tuple[str, ...]
    """in what the runs are not alike"""
    metrics: tuple[RunMetrics, ...]
    """of each run, over the time that all have"""

    @property
    def labels(self) -> str:
        """The letter of each run."""
        return ascii_uppercase[: len(self.runs)]

    def __repr__(self) -> str:
        return self.text()

    def text(self, width: int | None = None, *, unicode: bool = True) -> str:
        """Return table and notes; beyond `width` columns the figures of one run after the other."""
        rows = self.rows(unicode)
        first = max(len(name) for name, _ in rows)
        widths = [max(len(cells[at]) for _, cells in rows) for at in range(len(self.runs))]
        lines = [f"{label}  {one}" for label, one in zip(self.labels, self._described(), strict=True)]
        if width is None or first + sum(widths) + GAP * len(widths) <= width:
            table = [("", tuple(self.labels)), *rows]
            lines += ["", *(_line(name, cells, first, widths) for name, cells in table)]
        else:
            for at, label in enumerate(self.labels):
                lines += ["", label, *(f"  {name}: {cells[at]}" for name, cells in rows)]
        return "\n".join([*lines, *(["", *self.notes] if self.notes else [])])

    def plot(self, output: str | Path | None = None) -> Figure:
        """Draw outputs and estimate errors over each other; also into the file `output`, if given."""
        from tenbaud.recording.curves import draw_outputs
        from tenbaud.recording.style import save

        names = [run.metadata.get("preset", "") for run in self.runs]
        if len(set(names)) < len(names):
            names = [run.path.name for run in self.runs]
        labels = (f"{letter}: {name}" for letter, name in zip(self.labels, names, strict=True))
        labelled = list(zip(labels, self.runs, strict=True))
        figure = draw_outputs(labelled, self.outputs, self.metrics[0]["to_s"])
        if output is not None:
            make_folder(Path(output).parent)
            save(figure, [Path(output)])
        return figure

    def as_json(self) -> dict[str, Any]:
        """Return all figures as plain dictionaries, in the units of the recordings."""
        return {
            "outputs": self.outputs,
            "notes": self.notes,
            "runs": [
                {"label": label, "path": str(run.path), "preset": run.metadata.get("preset"), **found}
                for label, run, found in zip(self.labels, self.runs, self.metrics, strict=True)
            ],
        }

    def _repr_html_(self) -> str:
        from tenbaud.recording.style import picture_html

        return f"<pre>{escape(self.text())}</pre>{picture_html(self.plot())}"

    def rows(self, unicode: bool = True) -> list[tuple[str, tuple[str, ...]]]:
        """Return the table without its head: the name of each figure, and it for every run."""
        rows = [
            ("rate, bit/s", self._each(lambda one: _number(one["rate_bit_per_s"], ".4g"))),
            ("bits sent", self._each(lambda one: _number(one["bits"], ".12g"))),
            ("words lost", self._each(lambda one: _number(one["erasures"], "d"))),
            ("command lead", tuple([_lead(run) for run in self.runs])),
            ("error over floor", self._each(lambda one: _number(one["rms_over_floor"], ".2f"))),
        ]
        for name in self.outputs:
            of = f"{name.replace('_', ' ')}: " if len(self.outputs) > 1 else ""
            each = [one["outputs"][name] for one in self.metrics]
            rows += [
                (of + label, tuple([text(one, unicode) for one in each])) for label, text in _OF_OUTPUT
            ]
        return [row for row in rows if any(cell != NOTHING for cell in row[1])]

    def _each(self, text: Callable[[RunMetrics], str]) -> tuple[str, ...]:
        return tuple([text(one) for one in self.metrics])

    def _described(self) -> list[str]:
        """Return what each run is, its folder first."""
        names = [run.path.name for run in self.runs]
        if len(set(names)) < len(names):
            names = [str(run.path) for run in self.runs]
        return [", ".join([name, *_about(run)]) for name, run in zip(names, self.runs, strict=True)]


def compare(*runs: Run | str | Path) -> SideBySide:
    """Return the figures of two or more runs side by side, over the time and outputs that all have.

        print(compare("runs/slow", "runs/fast"))

    Raises RecordingError for runs without a common output or time.
    """
    opened = tuple([one if isinstance(one, Run) else Run(one) for one in runs])
    if not 2 <= len(opened) <= RUNS_MAX:
        raise RecordingError(f"give 2 to {RUNS_MAX} runs, not {len(opened)}")
    outputs, notes = _common_outputs(opened)
    span, more = _common_span(opened)
    notes = [*_of_each(opened), *notes, *more, *_other_references(opened, outputs, span)]
    metrics = [run.metrics(from_s=span[0], to_s=span[1]) for run in opened]
    return SideBySide(opened, outputs, tuple(notes), tuple(metrics))


def _lead(run: Run) -> str:
    """Return how far ahead the commands of a run are decided, on the estimate of that time."""
    ticks = run.summary.get("lead_ticks")
    return NOTHING if ticks is None else f"{float(ticks) * run.base.tick_s * 1e3:g} ms"


def _about(run: Run) -> list[str]:
    preset, plant = run.metadata.get("preset"), run.summary.get("plant")
    last_s = float(run.time_s[-1]) + run.base.tick_s
    return [*(one for one in (preset, plant) if one), f"{last_s:g} s"]


def _common_outputs(runs: Sequence[Run]) -> tuple[tuple[str, ...], list[str]]:
    each = [[(one.name, one.unit) for one in run.plant.outputs] for run in runs]
    common = set(each[0]).intersection(*each)
    listed = "; ".join(
        f"{label} has {', '.join(f'{one.name} ({one.unit})' for one in run.plant.outputs)}"
        for label, run in zip(ascii_uppercase, runs, strict=False)
    )
    if not common:
        raise RecordingError(f"the runs have no output in common: {listed}")
    names = tuple([one.name for one in runs[0].plant.outputs if (one.name, one.unit) in common])
    if all(one == each[0] for one in each):
        return names, []
    return names, [f"The plants differ: {listed}. Compared: {', '.join(names)}."]


def _common_span(runs: Sequence[Run]) -> tuple[tuple[float, float], list[str]]:
    """Return from when to when errors are compared, and what should be known of that."""
    ends = [float(run.time_s[-1]) + run.base.tick_s for run in runs]
    begin_s, end_s = max(float(run.time_s[0]) for run in runs), min(ends)
    last_s = min(float(run.time_s[-1]) for run in runs)
    if last_s <= begin_s:
        raise RecordingError("the runs have no flight time in common: one ends before another begins")
    settled_s = max(float(run.summary.get("window_start_s") or 0.0) for run in runs)
    notes = []
    if settled_s >= last_s:
        notes.append(f"The runs share {end_s:g} s: errors count from their beginning.")
        settled_s = begin_s
    longest = max(ends)
    if longest - end_s > max(run.base.tick_s for run in runs):
        notes.append(
            f"The lengths differ, {end_s:g} to {longest:g} s: errors, tracking and steps are of the "
            f"time up to {end_s:g} s, rate, bits and lost words of each whole flight."
        )
    start_s = max(settled_s, begin_s)
    notes.append(
        f"Errors from {start_s:g} s on, those of the estimates as used, a command lead ahead. Rise, "
        "overshoot, settling: medians over the steps. Floor: the least error of any code at this rate."
    )
    return (start_s, last_s), notes


def _of_each(runs: Sequence[Run]) -> list[str]:
    """Return what to know about each run before reading its figures."""
    found = []
    for label, run in zip(ascii_uppercase, runs, strict=False):
        if run.summary.get("exit_code"):
            found.append(f"{label}: {verdict_of(run.summary)}")
        elif not run.summary:
            found.append(f"{label}: there is no summary.json: bits and lost words are not known")
        found += [f"{label}: {note}" for note in run.notes]
    return found


def _other_references(
    runs: Sequence[Run], outputs: Sequence[str], span: tuple[float, float]
) -> list[str]:
    at_s = np.linspace(*span, REFERENCE_POINTS)
    for name in outputs:
        held = []
        for run in runs:
            place = [one.name for one in run.plant.outputs].index(name)
            signal = run.signal(output_name(run.plant, "reference", place))
            if signal is None:
                break
            held.append(signal.values[np.searchsorted(run.time_s, at_s, side="right") - 1])
        held = [one for one in held if not np.isnan(one).all()]
        size = max((float(np.nanmax(np.abs(one))) for one in held), default=0.0)
        for one, other in pairwise(held):
            if np.mean(np.abs(one - other) > 0.01 * size) > REFERENCE_SHARE:
                return [f"The set-points of {name} differ: tracking and steps cannot be compared."]
    return []


def _number(value: float | None, form: str) -> str:
    return NOTHING if value is None else f"{value:{form}}"


def _size(name: str, digits: int) -> Callable[[OutputMetrics, bool], str]:
    def text(one: OutputMetrics, unicode: bool) -> str:
        value = one[name]  # type: ignore[literal-required]
        return NOTHING if value is None else value_text(value, one["unit"], digits, unicode)

    return text


def _step(name: str, form: str) -> Callable[[OutputMetrics, bool], str]:
    def text(one: OutputMetrics, _unicode: bool) -> str:
        values = [step[name] for step in one["steps"]]  # type: ignore[literal-required]
        known = [value for value in values if value is not None]
        if not known:
            return f"0 of {len(values)}" if values else NOTHING
        count = f" ({len(known)} of {len(values)})" if len(known) < len(values) else ""
        return form.format(float(np.median(known))) + count

    return text


_OF_OUTPUT: tuple[tuple[str, Callable[[OutputMetrics, bool], str]], ...] = (
    ("estimate error rms", _size("error_live_rms", 2)),
    ("estimate error max", _size("error_live_max", 2)),
    ("tracking error rms", _size("tracking_rms", 1)),
    ("steps", lambda one, _: str(len(one["steps"]) or NOTHING)),
    ("rise time, 10-90 %", _step("rise_time_s", "{:.3g} s")),
    ("overshoot", _step("overshoot_fraction", "{:.1%}")),
    (f"settling to {SETTLING_BAND:.0%}", _step("settling_time_s", "{:.3g} s")),
)


def _line(name: str, cells: Sequence[str], first: int, widths: Sequence[int]) -> str:
    padded = (f"{cell:>{width + GAP}}" for cell, width in zip(cells, widths, strict=True))
    return (f"{name:{first}}" + "".join(padded)).rstrip()
