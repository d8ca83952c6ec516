"""The format of a log, by content and suffix, and what reads it."""

from __future__ import annotations

from pathlib import Path

from tenbaud.log.table import LogError, Table, Wanted
from tenbaud.log.text import read_text


def read_table(path: str | Path, wanted: Wanted | None = None) -> Table:
    """Return the columns of a log that `wanted` chooses from their names, all of them without it.

    LogError for a file that cannot be read or holds no table.
    """
    path = Path(path)
    if path.is_dir():
        raise LogError(f"{path} is a folder and holds no run; give a log file, or the folder of a run")
    return read_text(path, wanted)
