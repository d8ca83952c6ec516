"""Parquet, NumPy, TDMS (LabVIEW) and MCAP of other programs as tables."""

from __future__ import annotations

from array import array
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import orjson

from tenbaud.log.signal_sets import flat_table, table_of
from tenbaud.log.table import Array, LogError, Table, Wanted, unreadable
from tenbaud.log.variables import Clock, Variable, seconds, variables_of

LIST_MAX = 64
"""Numbers of one field of a message that become columns."""
NEEDS = "{path} needs {package}, which is not installed: pip install 'tenbaud[logs]'."


def read_parquet(path: Path, wanted: Wanted | None = None) -> Table:
    """Return the columns of numbers and times of a Parquet file; LogError where there are none."""
    try:
        from pyarrow import parquet
    except ImportError as error:
        raise LogError(NEEDS.format(path=path, package="pyarrow")) from error
    with unreadable(path, "a Parquet file"), parquet.ParquetFile(path) as file:
        units = dict(_parquet_columns(file))
        if not units:
            raise LogError(f"{path} has no column of numbers; it has {', '.join(file.schema.names)}")
        return flat_table(path, "Parquet file", units, partial(_parquet_column, file), wanted)


def _parquet_columns(file: Any) -> Iterator[tuple[str, str]]:
    """Yield name and unit of every column of numbers or times."""
    import pyarrow

    kinds = pyarrow.types
    numbers = (kinds.is_integer, kinds.is_floating, kinds.is_boolean, kinds.is_decimal)
    for field in file.schema_arrow:
        about = field.metadata or {}
        if kinds.is_timestamp(field.type) or kinds.is_duration(field.type):
            yield field.name, "s"
        elif any(is_kind(field.type) for is_kind in numbers):
            yield field.name, about.get(b"unit", b"").decode()


def _parquet_column(file: Any, name: str) -> Array:
    import pyarrow

    # One column at a time: the file's own form of all of them would double the memory.
    column = file.read(columns=[name]).column(0)
    if not pyarrow.types.is_temporal(column.type):
        column = column.cast(pyarrow.float64(), safe=False)
    return seconds(column.to_numpy())


def read_numpy(path: Path, wanted: Wanted | None = None) -> Table:
    """Return the signals in an `.npy` or `.npz` file; LogError where there are none."""
    advice = "Save arrays of numbers: numpy.savez(file, time=..., angle=...)."
    with unreadable(path, "a NumPy file", advice):
        loaded = np.load(path)
        if isinstance(loaded, np.ndarray):
            kind, tree = "NumPy array", _fields(path.stem, loaded)
        else:
            kind, tree = "NumPy archive", {}
            with loaded as file:
                for name in file.files:
                    tree |= _fields(name, file[name])
    return table_of(path, kind, variables_of(tree), wanted)


def _fields(name: str, values: np.ndarray[Any, Any]) -> dict[str, Any]:
    if values.dtype.names is None:
        return {name: values}
    return {field: values[field] for field in values.dtype.names}


def read_tdms(path: Path, wanted: Wanted | None = None) -> Table:
    """Return the channels of a TDMS file; LogError where there are none, or of several lengths."""
    try:
        from nptdms import TdmsFile
    except ImportError as error:
        raise LogError(NEEDS.format(path=path, package="npTDMS")) from error
    with unreadable(path, "a TDMS file"), TdmsFile.open(path) as file:
        groups = file.groups()
        found = [
            _channel(channel, group.name if len(groups) > 1 else "")
            for group in groups
            for channel in group.channels()
            if len(channel) and channel.dtype is not None and channel.dtype.kind in "biufmM"
        ]
    return table_of(path, "TDMS file", found, wanted)


def _channel(channel: Any, group: str) -> Variable:
    about = channel.properties
    values = channel[:]
    step_s = float(about.get("wf_increment", 0.0))
    clock = None
    if step_s > 0.0:
        start_s = float(about.get("wf_start_offset", 0.0))
        clock = Clock("time", seconds(start_s + step_s * np.arange(len(values))), "s")
    unit = str(about.get("unit_string") or about.get("NI_UnitDescription") or "")
    if values.dtype.kind in "mM":
        values, unit = seconds(values), "s"
    return Variable(f"{group}.{channel.name}" if group else channel.name, values, unit, clock)


def read_messages(path: Path, wanted: Wanted | None = None) -> Table:
    """Return the numbers in the JSON messages of an MCAP file, over the time at which they were logged.

    LogError where no topic has JSON messages, and for several topics unless `wanted` chooses one.
    """
    from mcap.reader import make_reader

    topics: dict[str, _Topic] = {}
    others: dict[str, str] = {}
    first_ns: int | None = None
    with unreadable(path, "an MCAP file"), path.open("rb") as stream:
        for _, channel, message in make_reader(stream).iter_messages():
            if channel.message_encoding != "json":
                others[channel.topic] = channel.message_encoding or "no encoding"
                continue
            first_ns = message.log_time if first_ns is None else first_ns
            topic = topics.setdefault(channel.topic, _Topic())
            topic.add((message.log_time - first_ns) * 1e-9, orjson.loads(message.data))
    if not topics:
        there = ", ".join(f"{name} ({how})" for name, how in sorted(others.items())) or "no messages"
        raise LogError(
            f"{path} holds no JSON messages, which are the only ones that are read; it holds {there}. "
            "Save the signals as CSV with the program that wrote it."
        )
    found = [
        one
        for name, topic in topics.items()
        for one in topic.variables(f"{name.strip('/').replace('/', '.')}." if len(topics) > 1 else "")
    ]
    return table_of(path, "MCAP file, JSON messages over their log time", found, wanted)


class _Topic:
    """The numbers of the messages of one topic, field by field."""

    def __init__(self) -> None:
        self.times_s = array("d")
        self.fields: dict[str, array[float]] = {}

    def add(self, time_s: float, message: Any) -> None:
        """Add the row of one message; a field that it lacks is NaN."""
        rows = len(self.times_s)
        self.times_s.append(time_s)
        for name, value in _numbers(message):
            column = self.fields.setdefault(name, array("d"))
            if len(column) <= rows:  # a field that comes twice keeps its first value
                column.extend([np.nan] * (rows - len(column)))
                column.append(value)

    def variables(self, prefix: str) -> Iterator[Variable]:
        """Yield the fields over the times of the messages."""
        clock = Clock(f"{prefix}log_time", np.array(self.times_s), "s")
        for name, column in self.fields.items():
            column.extend([np.nan] * (len(self.times_s) - len(column)))
            yield Variable(f"{prefix}{name}", _array(column), "", clock)


def _array(values: array[float]) -> Array:
    return np.array(values, dtype=np.float64)


def _numbers(value: Any, path: str = "") -> Iterator[tuple[str, float]]:
    """Yield the numbers of a message under their dotted names."""
    if isinstance(value, int | float):
        yield path or "value", float(value)
    elif isinstance(value, dict):
        for name, item in value.items():
            yield from _numbers(item, f"{path}.{name}" if path else name)
    elif isinstance(value, list) and len(value) <= LIST_MAX:
        for number, item in enumerate(value, start=1):
            yield from _numbers(item, f"{path}.{number}" if path else str(number))
