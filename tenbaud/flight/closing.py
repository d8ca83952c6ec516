"""The closing lines of a flight: verdict, warnings, a few figures, files to open, next command."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from tenbaud.recording.folder import RunFolder
from tenbaud.sentences.flown import Summary, figures_of, verdict_of, warnings_of

LABEL_WIDTH = 16


def closing_lines(
    summary: Summary, folder: RunFolder, *, unicode: bool = True, then: str | None = None
) -> list[str]:
    """Return the lines that end a flight on a terminal; angles are in degrees.

    `then`: the next command after a flight that ended well; None: its replay.
    """
    lines = [verdict_of(summary, unicode)]
    lines += [f"  {'! ' if not unicode else '⚠ '}{text}" for text in warnings_of(summary)]
    shown = [*figures_of(summary, unicode), _what_next(summary, folder, then)]
    return lines + [f"  {label:{LABEL_WIDTH}}{text}" for label, text in shown]


def _what_next(summary: Summary, folder: RunFolder, then: str | None) -> tuple[str, str]:
    """Return the file to open and the next command, as a label and its text."""
    path = _shown(folder.path)
    drawn = folder.figure.is_file()
    label, place = ("Open", f"{path}/{folder.figure.name}") if drawn else ("Recorded in", path)
    failed = int(summary["exit_code"])
    following = f"tenbaud inspect {path}" if failed else then or f"tenbaud replay {path}"
    return label, f"{place}   Next: {following}"


def _shown(path: Path) -> str:
    text: Any = str(path)
    return f'"{text}"' if " " in text else text
