"""A recorded run, read back for work in Python.

from tenbaud import Run

run = Run("runs/2026-11-23T10-00-00_paper-10baud")
run.pitch          # rad, one value per tick
run.time_s         # the common time base
run.plot()
"""

from __future__ import annotations

from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from tenbaud.recording.errors import RecordingError
from tenbaud.recording.recorded import RecordedRun
from tenbaud.recording.steps import SETTLING_BAND
from tenbaud.sentences.flown import figures_of, verdict_of, warnings_of

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.figure import Figure

    from tenbaud.recording.metrics import RunMetrics

OUTPUTS_DRAWN = 3
"""in a notebook"""
DRAWN_SIZE = 0.75


class Run(RecordedRun):
    """One flight: its signals as numpy arrays on a common time base, and everything beside them.

    Every name in `signals` is an attribute: `run.reference`, `run.symbol`, and what the plant calls its
    outputs and inputs, as `run.pitch` and `run.front`. A file is read when something in it is first
    asked for. A recording that was cut by a crash is read up to the cut (`run.complete` is then False).
    """

    def _repr_html_(self) -> str:
        """Return the closing lines of the flight and its outputs, for a notebook."""
        from tenbaud.recording.curves import draw_outputs
        from tenbaud.recording.style import picture_html

        verdict = verdict_of(self.summary) if self.summary else f"{self!r}, no summary"
        parts = [f"<div><strong>{escape(verdict)}</strong><br><code>{escape(str(self.path))}</code>"]
        warnings = [*(warnings_of(self.summary) if self.summary else ()), *self.notes]
        parts += [f"<br>⚠ {escape(text)}" for text in warnings]
        if self.summary:
            cells = "".join(
                f'<tr><th style="text-align:left">{escape(label)}</th>'
                f'<td style="text-align:left">{escape(text)}</td></tr>'
                for label, text in figures_of(self.summary)
            )
            parts.append(f"<table>{cells}</table>")
        names = [one.name for one in self.plant.outputs][:OUTPUTS_DRAWN]
        if "transmitter" in self.ends:
            last_s = float(self.time_s[-1])
            parts.append(picture_html(draw_outputs([(names[0], self)], names, last_s, DRAWN_SIZE)))
        return "".join(parts) + "</div>"

    def metrics(
        self,
        *,
        from_s: float | None = None,
        to_s: float | None = None,
        settling_band: float = SETTLING_BAND,
    ) -> RunMetrics:
        """Return estimation errors, tracking error, step responses, bits and erasures.

            run.metrics()["outputs"]["pitch"]["error_live_rms"]

        Errors count from `from_s`, by default where the flight's own summary begins, to `to_s`.
        `settling_band` is a fraction of each step.
        """
        from tenbaud.recording.metrics import metrics_of

        return metrics_of(self, (from_s, to_s), settling_band)

    def to_pandas(self) -> pandas.DataFrame:
        """Return a row per tick, by flight time, and a column per signal; units are in `attrs`."""
        import pandas

        columns = {name: one.values for name, one in self.signals.items()}
        frame = pandas.DataFrame(columns, pandas.Index(self.time_s, name="time_s"))
        frame.attrs = {
            "units": self.units,
            "descriptions": {name: one.description for name, one in self.signals.items()},
            "preset": self.metadata.get("preset", ""),
        }
        return frame

    def to_xarray(self) -> xarray.Dataset:
        """Return the signals over `time_s`, each with unit and meaning; needs the extra `xarray`."""
        try:
            import xarray
        except ImportError as error:
            raise RecordingError("xarray is not installed: pip install 'tenbaud[xarray]'") from error
        variables = {
            name: ("time_s", one.values, {"units": one.unit, "long_name": one.description})
            for name, one in self.signals.items()
        }
        times = {"time_s": ("time_s", self.time_s, {"units": "s", "long_name": "flight time"})}
        return xarray.Dataset(variables, times, {"preset": self.metadata.get("preset", "")})

    def plot(self, output: str | Path | None = None) -> Figure:
        """Draw the flight as `flight.png` shows it; also into the file `output`, if given."""
        from tenbaud.recording.figure import FLIGHT_DOTS_PER_INCH, draw_run
        from tenbaud.recording.style import save

        figure = draw_run(self._files.get("transmitter"), self._files.get("receiver"), self._title())
        if output is not None:
            save(figure, [Path(output)], FLIGHT_DOTS_PER_INCH)
        return figure

    def _title(self) -> str:
        plant = self.summary.get("plant")
        return ": ".join(part for part in (self.metadata.get("preset"), plant) if part)
