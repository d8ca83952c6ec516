"""A run as three tables of plain columns, for the files of other tools.

`flight` has a row per tick and a column per signal, `samples` a row per sample, `events` a row per
thing that was reported.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from channel.protocol.events import EVENT_CHANNEL
from channel.protocol.recording import Field
from tenbaud.recording.run import Run
from tenbaud.recording.signals import Signal
from tenbaud.recording.table import Table

TABLES = ("flight", "samples", "events")


def flight_columns(run: Run) -> list[Signal]:
    """Return tick, time and every signal of the run."""
    columns = [
        Signal("tick", run.base.ticks, "", "index of the tick"),
        Signal("time_s", run.time_s, "s", "flight time"),
    ]
    return columns + [replace(one, name=one.column) for one in run.signals.values()]


def sample_columns(run: Run) -> list[Signal]:
    """Return what was recorded per sample, lists spread over numbered columns; [] without any."""
    for end in run.ends:
        if "sample" in run.topics(end):
            table = run.table(end, "sample")
            time_s = np.array(table.times_ns, dtype=np.float64) / 1e9
            columns = [column for one in table.channel.fields for column in _spread(table, one)]
            return [columns[0], Signal("time_s", time_s, "s", "flight time"), *columns[1:]]
    return []


def _spread(table: Table, one: Field) -> list[Signal]:
    values = table[one.name]
    if values.ndim == 1:
        if one.type == "integer" and not np.isnan(values).any():
            values = values.astype(np.int64)
        return [Signal(one.name, values, one.unit, one.description)]
    return [
        Signal(f"{one.name}_{axis}", values[:, axis], one.unit, one.description)
        for axis in range(values.shape[1])
    ]


def event_columns(run: Run) -> list[Signal]:
    """Return the events of both ends."""
    events = run.events
    described = (Field("end", "string", "", "which end reported it"), *EVENT_CHANNEL.fields, _TEXT)
    columns = []
    for one in described:
        values = [event.get(one.name) for event in events]
        number = one.type != "string"
        array = np.array(values, dtype=float if number else object)
        columns.append(Signal(one.name, array, one.unit, one.description))
    return columns


_TEXT = Field("text", "string", "", "a sentence made from the fields")


def all_columns(run: Run) -> dict[str, list[Signal]]:
    """Return the three tables by name; one without rows is left out."""
    makers = (flight_columns, sample_columns, event_columns)
    tables = {name: make(run) for name, make in zip(TABLES, makers, strict=True)}
    return {name: columns for name, columns in tables.items() if columns and len(columns[0].values)}
