"""What a notebook shows of a run: verdict, figures, a small picture."""

from __future__ import annotations

from base64 import b64encode
from html import escape
from io import BytesIO
from typing import TYPE_CHECKING

from tenbaud.recording.curves import draw_outputs
from tenbaud.sentences.flown import figures_of, verdict_of, warnings_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from tenbaud.recording.recorded import RecordedRun

OUTPUTS_DRAWN = 3
SIZE = 0.75


def run_html(run: RecordedRun) -> str:
    """Return a run as HTML: the closing lines of its flight, and its outputs."""
    parts = [f"<div><strong>{escape(_verdict(run))}</strong><br><code>{escape(str(run.path))}</code>"]
    warnings = [*(warnings_of(run.summary) if run.summary else ()), *run.notes]
    parts += [f"<br>⚠ {escape(text)}" for text in warnings]
    if run.summary:
        cells = "".join(
            f'<tr><th style="text-align:left">{escape(label)}</th>'
            f'<td style="text-align:left">{escape(text)}</td></tr>'
            for label, text in figures_of(run.summary)
        )
        parts.append(f"<table>{cells}</table>")
    names = [one.name for one in run.plant.outputs][:OUTPUTS_DRAWN]
    if "transmitter" in run.ends:
        figure = draw_outputs([(names[0], run)], names, float(run.time_s[-1]), SIZE)
        parts.append(picture_html(figure))
    return "".join(parts) + "</div>"


def _verdict(run: RecordedRun) -> str:
    return verdict_of(run.summary) if run.summary else f"{run!r}, no summary"


def picture_html(figure: Figure, dots_per_inch: int = 90) -> str:
    """Return a figure as an image in HTML."""
    stream = BytesIO()
    figure.savefig(stream, format="png", dpi=dots_per_inch)
    data = b64encode(stream.getvalue()).decode()
    return f'<img alt="outputs and estimate errors over time" src="data:image/png;base64,{data}">'
