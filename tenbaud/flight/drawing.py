"""Draws a flight in a notebook while it flies: its figure, and a progress bar above it."""

from __future__ import annotations

import time
from collections.abc import Sequence

from channel.protocol.recording import RecordChannel, Recorder
from tenbaud.build.flight import Agreement
from tenbaud.recording.errors import RecordingError
from tenbaud.recording.notebook import Cell, progress_html
from tenbaud.recording.overview import OverviewRecorder
from tenbaud.recording.style import picture_html

PERIOD_S = 0.5
DRAWING_SHARE = 0.25
"""of the time is spent on drawing at most, so that the flight is little slower"""


class NotebookDrawing:
    """The output of a cell for one flight, whose rows pass through here."""

    def __init__(self, agreement: Agreement) -> None:
        self._agreement = agreement
        self._ends = (OverviewRecorder(agreement.signals), OverviewRecorder(agreement.signals))
        self._tick = 0
        self._cell = Cell()
        self._due_s = time.monotonic() + PERIOD_S
        self._cell.show(self._progress())

    def recorders(self, upper: Recorder, lower: Recorder) -> tuple[Recorder, Recorder]:
        """Return what both ends record into, in place of their own recorders."""
        return _Passing(upper, self._ends[0]), _Passing(lower, self._ends[1])

    def at_tick(self, tick: int) -> None:
        """Draw, if it is time to."""
        self._tick = tick
        start_s = time.monotonic()
        if start_s >= self._due_s:
            self._cell.show(self._progress() + self._picture())
            end_s = time.monotonic()
            self._due_s = end_s + max(PERIOD_S, (end_s - start_s) / DRAWING_SHARE)

    def end(self) -> None:
        """Draw the whole flight, which is over."""
        self._cell.show(self._picture())

    def _progress(self) -> str:
        tick_s, ticks = self._agreement.terms.tick_ns / 1e9, self._agreement.flight_ticks
        text = f"{self._tick * tick_s:.1f} s of {ticks * tick_s:g} s"
        return progress_html(self._tick, ticks, text)

    def _picture(self) -> str:
        from tenbaud.recording.figure import draw_overviews

        upper, lower = (end.overview() for end in self._ends)
        config = self._agreement.config
        try:
            return picture_html(
                draw_overviews(upper, lower, config.link.impairments, config.preset, None),
                dots_per_inch=72,
            )
        except RecordingError:  # no tick yet
            return ""


class _Passing:
    """Hands rows on to a recorder and to an overview."""

    def __init__(self, *recorders: Recorder) -> None:
        self._recorders = recorders

    def write(self, channel: RecordChannel, time_ns: int, row: Sequence[object]) -> None:
        for recorder in self._recorders:
            recorder.write(channel, time_ns, row)
