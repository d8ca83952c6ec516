"""The closing lines of a flight: verdict, warnings, a few figures, files to open, next command."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from tenbaud.flight.summary import Summary
from tenbaud.recording.folder import RunFolder
from tenbaud.sentences.flown import figures_of, verdict_of, warnings_of

LABEL_WIDTH = 16


def closing_lines(summary: Summary, folder: RunFolder, *, unicode: bool = True) -> list[str]:
    """Return the lines that end a flight on a terminal; angles are in degrees."""
    lines = [verdict_of(summary, unicode)]
    lines += [f"  {'! ' if not unicode else '⚠ '}{text}" for text in warnings_of(summary)]
    shown = [*figures_of(summary, unicode), _what_next(summary, folder)]
    return lines + [f"  {label:{LABEL_WIDTH}}{text}" for label, text in shown]


def _what_next(summary: Summary, folder: RunFolder) -> tuple[str, str]:
    """Return the file to open and the next command, as a label and its text."""
    path = _shown(folder.path)
    drawn = folder.figure.is_file()
    label, place = ("Open", f"{path}/{folder.figure.name}") if drawn else ("Recorded in", path)
    if int(summary["exit_code"]):
        return label, f"{place}   Next: tenbaud inspect {path}"
    if summary["clock"] == "real":
        return label, f"{place}   Next: tenbaud replay {path}"
    return label, f"{place}   Next: tenbaud demo --view"


def _shown(path: Path) -> str:
    text: Any = str(path)
    return f'"{text}"' if " " in text else text
