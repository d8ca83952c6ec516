"""Where the rules look: the packages, and the text of their files."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

TOP = Path(__file__).resolve().parents[2]
PACKAGES = ("channel", "transmitter", "receiver", "plant_sim", "tenbaud")
"""What the wheel holds."""

OUTSIDE = ("reproduction",)
"""Packages of the checkout that are not in the wheel."""


def name_of(path: Path) -> str:
    """Return the path as the rules write it: from the top folder, with forward slashes."""
    return path.relative_to(TOP).as_posix()


def files_below(*folders: str, pattern: str = "*.py") -> Iterator[tuple[str, str]]:
    """Yield (name, text) of every file below the folders that exist, in a fixed order."""
    for folder in folders:
        for path in sorted((TOP / folder).rglob(pattern)):
            if path.is_file() and "__pycache__" not in path.parts:
                yield name_of(path), path.read_text(encoding="utf-8")


def report(findings: list[str]) -> str:
    """Return a failure message with one finding on each line."""
    return f"{len(findings)} findings:\n" + "\n".join(findings)
