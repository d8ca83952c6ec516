"""A flight's figures for people: a table on the screen, and `summary.json` in the run folder."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tenbaud.config.load import flattened
from tenbaud.config.schema import FlightConfig
from tenbaud.files.whole import WriteError, remove, write_whole
from tenbaud.flight.outcome import ExitCode, Outcome, outcome_of
from tenbaud.recording.errors import RecordingError
from tenbaud.recording.folder import RunFolder
from tenbaud.sentences.flown import Summary

if TYPE_CHECKING:
    from rich.table import Table

    from tenbaud.recording.envelope import Curve


def write_up(
    folder: RunFolder, config: FlightConfig, summary: Summary, draw: bool, usual: Curve | None = None
) -> list[Outcome]:
    """Write `summary.json` and, if wished, the figure; return what went wrong.

    `usual`: how the usual loop steers the first output, for the figure.

    The flight is over by then: what cannot be written is no reason to leave out the rest. It is the
    outcome in `summary` of a flight that has no other.
    """
    problems = []
    recording_error = summary.get("recording_error")
    if recording_error:
        problems.append(Outcome(ExitCode.NOT_WRITTEN, recording_error))
    try:
        write_summary(folder, summary)
    except WriteError as error:
        problems.append(outcome_of(error))
    if draw:
        try:
            draw_figure(folder, figure_title(config, summary), usual)
        except (RecordingError, WriteError) as error:
            code = ExitCode.NOT_WRITTEN if isinstance(error, WriteError) else ExitCode.OK
            problems.append(Outcome(code, f"no figure was drawn: {error}"))
    failed = [one for one in problems if one.code is not ExitCode.OK]
    if failed and not summary["exit_code"]:
        summary |= {"exit_code": int(failed[0].code), "outcome": failed[0].text}
    return problems


@contextmanager
def removed_unless_begun(folder: RunFolder) -> Iterator[None]:
    """Remove a new folder where an exception ends the `with` before a tick or a sample is recorded."""
    try:
        yield
    except BaseException as error:
        if not any(map(_holds_rows, folder.recordings())):
            remove(folder.path)
            if isinstance(error, KeyboardInterrupt):
                sys.stderr.write("tenbaud: stopped before the flight\n")
        raise


def removed_as_not_begun(folder: RunFolder, summary: Summary, code: ExitCode) -> bool:
    """Remove the folder of a run that was refused or interrupted before its first sample, if it was."""
    unfit = code in (ExitCode.USAGE, ExitCode.INTERRUPTED) and not summary.get("samples")
    if unfit:
        remove(folder.path)
    return unfit


def _holds_rows(path: Path) -> bool:
    from tenbaud.recording.reader import MessageStream, rows_in_blocks

    try:
        wanted = {"tick": None, "sample": None}
        return any(rows for block in rows_in_blocks(MessageStream(path), wanted) for rows in block)
    except RecordingError:
        return True  # not known


def write_summary(folder: RunFolder, summary: Summary) -> None:
    """Write `summary.json`. Raises WriteError."""
    write_whole(folder.summary, json.dumps(summary, indent=2) + "\n")


def draw_figure(folder: RunFolder, title: str, usual: Curve | None = None) -> None:
    """Draw the figure of a run from its recordings. Raises RecordingError and WriteError."""
    from tenbaud.recording.figure import FLIGHT_DOTS_PER_INCH, draw_run
    from tenbaud.recording.style import save

    receiver = folder.receiver if folder.receiver.is_file() else None
    # Its recordings were made just now.
    figure = draw_run(folder.transmitter, receiver, title, own=True, usual=usual)
    save(figure, [folder.figure], FLIGHT_DOTS_PER_INCH)


def figure_title(config: FlightConfig, summary: Summary) -> str:
    """Return the title of a flight's figure."""
    return f"{config.preset}: {summary.get('plant', '')}, {config.channel.rate_baud:g} bit/s"


def show_summaries(
    summaries: Sequence[Summary],
    folders: Sequence[RunFolder],
    *,
    verbose: bool = False,
    then: str | None = None,
) -> None:
    """Print how flights ended; with `verbose` also every figure, the flights side by side.

    `then` is as for `closing_lines`.
    """
    from rich.console import Console

    from tenbaud.flight.closing import closing_lines
    from tenbaud.flight.narrow import for_terminal
    from tenbaud.flight.screen import unicode_fits

    console = Console()
    if verbose:
        console.print(_table(summaries))
    for summary, folder in zip(summaries, folders, strict=True):
        lines = closing_lines(summary, folder, unicode=unicode_fits(console), then=then)
        text = for_terminal("\n".join(lines))
        console.print(text, soft_wrap=True, highlight=False, markup=False)


def _table(summaries: Sequence[Summary]) -> Table:
    """Return every figure that a flight has, by its name in `summary.json`, flights side by side."""
    from rich.table import Table

    first = summaries[0]
    title = f"{first['preset']} over {first['link']}, {first['clock']} clock"
    table = Table(title=title, title_justify="left", show_header=False)
    table.add_column(style="dim")
    for _ in summaries:
        table.add_column(overflow="fold")
    flat = [dict(flattened(one)) for one in summaries]
    for name in dict.fromkeys(name for one in flat for name in one):
        cells = [_cell(one.get(name)) for one in flat]
        if any(cells):
            table.add_row(name, *cells)
    return table


def _cell(value: Any) -> str:
    if isinstance(value, list):
        return ", ".join(map(str, value))
    return "" if value is None else f"{value:.4g}" if isinstance(value, float) else str(value)
