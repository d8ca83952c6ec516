"""Notes that a person should read before trusting results from a recording."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from tenbaud.recording.holes import Hole

HOLES_SHOWN = 5


def recording_notes(
    path: Path, metadata: Mapping[str, str], complete: bool, holes: Sequence[Hole], strays: int
) -> list[str]:
    """Return a sentence for another version, a cut, each hole; none for a whole file of our own."""
    notes = version_notes(path, metadata)
    if not complete and not holes:
        notes.append(f"{path} was cut: these are its rows up to the cut")
    return notes + hole_notes(path, holes) + stray_notes(path, strays)


def version_notes(path: Path, metadata: Mapping[str, str]) -> list[str]:
    """Return a sentence if another version recorded this."""
    from tenbaud.config.version import software_version

    version, here = metadata.get("version"), software_version()
    if version in (None, here):
        return []
    return [f"{path} was recorded by tenbaud {_printable(str(version))}; this is {here}"]


def hole_notes(path: Path, holes: Sequence[Hole]) -> list[str]:
    """Return a sentence for each hole, for the first few if there are many."""
    notes = [f"{path} has a hole at {_printable(str(hole))}" for hole in holes[:HOLES_SHOWN]]
    if len(holes) > HOLES_SHOWN:
        notes.append(f"{path} has {len(holes) - HOLES_SHOWN} holes more")
    return notes


def stray_notes(path: Path, strays: int) -> list[str]:
    """Return a sentence where rows are left out that nothing describes."""
    return [f"{path}: {strays} rows are left out, the file does not describe them"] if strays else []


def _printable(text: str) -> str:
    return printable(text[:200])


def printable(text: str) -> str:
    """Return a foreign text without terminal control characters."""
    return "".join(
        one if one.isprintable() or one == "\n" else "\N{REPLACEMENT CHARACTER}" for one in text
    )
