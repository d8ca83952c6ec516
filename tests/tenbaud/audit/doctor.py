"""Recordings that were changed after the flight, as an audit must notice."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

from tenbaud.recording.encoding import RUN_METADATA
from tenbaud.recording.reader import MessageStream
from tenbaud.recording.writer import McapRecorder

Row = dict[str, Any]
Edit = Callable[[Row], list[Row]]
"""A row as it was -> the rows that take its place: none, one or several."""


def doctored(run: Path, folder: Path, end: str, topic: str, edit: Edit, **head: str) -> Path:
    """Return a copy of a run in which one topic of one end, and its head, were edited."""
    shutil.copytree(run, folder)
    path = folder / f"{end}.mcap"
    stream = MessageStream(path)
    messages = list(stream)
    path.unlink()
    with McapRecorder(path, {**stream.metadata[RUN_METADATA], **head}, wait_when_full=True) as recorder:
        for name, time_ns, row in messages:
            channel = stream.channels[name]
            for kept in edit(row) if name == topic else [row]:
                values = [kept[field.name] for field in channel.fields]
                recorder.write(channel, time_ns, values)
    assert recorder.error is None
    return folder


def at(key: str, value: int, change: Callable[[Row], Row]) -> Edit:
    """Change the rows whose field `key` has this value."""
    return lambda row: [change(dict(row))] if row[key] == value else [row]
