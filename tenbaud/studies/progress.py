"""A progress bar on standard error or in a notebook, for commands that compute for a while."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from tenbaud.recording.notebook import Cell, in_notebook

TEXT_CELLS = 45
"""What stands beside the bar needs about so much of a line."""

Update = Callable[[float, float, str], None]
"""(done, of how much, what is being done)"""


@contextmanager
def progress_bar(what: str, *, counted: bool = False) -> Iterator[Update]:
    """Within a `with`, show a bar.

    `counted`: with how many of how many beside it, left on the terminal at the end, and written to a
    file too; else a bar that a terminal alone shows, and that vanishes.
    """
    if in_notebook():
        cell = Cell()
        yield cell.show_progress
        return
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )
    from rich.table import Column

    console = Console(stderr=True)
    bar = Progress(
        TextColumn("{task.description}", table_column=Column(no_wrap=True)),
        BarColumn(max(5, min(40, console.width - TEXT_CELLS))),
        MofNCompleteColumn() if counted else TimeElapsedColumn(),
        TimeRemainingColumn(),
        console=console,
        transient=not counted,
        disable=not counted and not sys.stderr.isatty(),
    )
    with bar:
        task = bar.add_task(what, total=None)
        yield lambda done, total, now: bar.update(task, completed=done, total=total, description=now)
