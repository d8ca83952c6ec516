"""Warnings that show the line of the caller's program, and none of this package."""

from __future__ import annotations

import sys
import warnings
from types import FrameType

PACKAGE = __name__.partition(".")[0]


def warn(text: str, category: type[Warning]) -> None:
    """Warn at the nearest line outside this package; at the outermost one where all are inside."""
    frame: FrameType | None = sys._getframe()
    level = 1
    while frame is not None and _is_ours(frame) and frame.f_back is not None:
        frame = frame.f_back
        level += 1
    warnings.warn(text, category, stacklevel=level)


def _is_ours(frame: FrameType) -> bool:
    name = frame.f_globals.get("__name__", "")
    return isinstance(name, str) and f"{name}.".startswith(f"{PACKAGE}.")
