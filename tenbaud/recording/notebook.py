"""What a notebook shows while something goes on: one output of the cell, replaced again and again."""

from __future__ import annotations

import sys
import time
from html import escape
from importlib import import_module
from typing import Any

PERIOD_S = 0.2


def in_notebook() -> bool:
    """Return whether this process is the kernel of a notebook."""
    ipython = sys.modules.get("IPython")
    return ipython is not None and getattr(ipython.get_ipython(), "kernel", None) is not None


class Cell:
    """An output of the cell that runs now."""

    def __init__(self) -> None:
        # Only a notebook has it.
        shown: Any = import_module("IPython.display")
        self._html = shown.HTML
        self._handle = shown.display(shown.HTML(""), display_id=True)
        self._shown_s = 0.0

    def show(self, html: str) -> None:
        """Put other HTML in its place."""
        self._handle.update(self._html(html))
        self._shown_s = time.monotonic()

    def show_progress(self, done: float, total: float, text: str) -> None:
        """Show a progress bar, a few times a second at most."""
        if done >= total or time.monotonic() - self._shown_s >= PERIOD_S:
            self.show(progress_html(done, total, text))


def progress_html(done: float, total: float, text: str) -> str:
    """Return a progress bar with a text beside it."""
    share = done / total if total else 0.0
    return (
        f'<div><progress value="{share:.4f}" max="1" style="width:20em"></progress> '
        f"{share:.0%} {escape(text)}</div>"
    )
