"""A run for other tools: CSV, MATLAB, Parquet, JSON, and one MCAP file for the viewers."""

from __future__ import annotations

import csv
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import orjson
from numpy.typing import NDArray

from channel.protocol.recording import Field, RecordChannel
from tenbaud.files.whole import make_folder, whole_path
from tenbaud.recording.columns import TABLES, all_columns, flight_columns
from tenbaud.recording.errors import RecordingError
from tenbaud.recording.layouts import flight_layouts, layout_paths
from tenbaud.recording.run import Run
from tenbaud.recording.signals import Signal

ROWS_AT_ONCE = 10_000


def convert(run: Run, form: str, output: Path | None = None, overwrite: bool = False) -> list[Path]:
    """Write a run in another form; return the files that were written.

    Without `output` it goes into the folder of the run: `csv/` and `parquet/` have a file per table,
    the other forms are one file, `flight.mat`, `flight.json` or `flight.mcap`, which has layouts for
    its viewers beside it. What exists already is replaced only with `overwrite`. Raises
    RecordingError for an unknown form, a run that cannot be read and a place that cannot be written.
    """
    if form not in FORMS:
        raise RecordingError(f"A run cannot become {form!r}. Known: {', '.join(FORMS)}.")
    default, write = FORMS[form]
    target = output or run.folder.path / default
    layouts = layout_paths(target) if form == "mcap" else []
    # A symbolic link counts as something, wherever it leads.
    there = [path for path in (target, *layouts) if path.exists() or path.is_symlink()]
    if there and not overwrite:
        raise RecordingError(
            f"{there[0]} exists already and is not overwritten. Add --force, or choose another place "
            "with --out."
        )
    if target.exists():
        _check_replaceable(run, form, target)
    make_folder(target.parent)
    with whole_path(target) as part:
        write(run, part)
    if layouts:
        flight_layouts(run, target)
    return sorted(target.iterdir()) if target.is_dir() else [target, *layouts]


def _check_replaceable(run: Run, form: str, target: Path) -> None:
    """Raise RecordingError where replacing `target` would take more than an earlier conversion."""
    is_folder = form in ("csv", "parquet")
    folder = run.folder
    own = (run.path, folder.config, folder.summary, folder.figure, folder.transmitter, folder.receiver)
    if target.is_dir() != is_folder:
        there, wanted = ("file", "folder") if is_folder else ("folder", "file")
        why = f"it is a {there}, and {form} is a {wanted}"
    elif target.resolve() in [one.resolve() for one in own]:
        why = "it is a part of the run itself"
    elif is_folder and (
        others := {one.name for one in target.iterdir()} - {f"{table}.{form}" for table in TABLES}
    ):
        why = f"it holds {min(others)}, which no conversion wrote"
    else:
        return
    raise RecordingError(f"{target} is not replaced: {why}. Choose another place with --out.")


def _write_csv(run: Run, folder: Path) -> None:
    """A line of names, then a line per row; numbers read back to the same bits, nothing for NaN."""
    folder.mkdir()
    for name, columns in all_columns(run).items():
        with (folder / f"{name}.csv").open("w", encoding="utf-8", newline="") as stream:
            writer = csv.writer(stream)
            writer.writerow([column.name for column in columns])
            for rows in _stretches(columns):
                writer.writerows(zip(*[_cells(column, rows) for column in columns], strict=True))


def _stretches(columns: list[Signal]) -> Iterator[slice]:
    """Yield the rows of a table a stretch at a time: as objects they take ten times the memory."""
    count = len(columns[0].values)
    for start in range(0, count, ROWS_AT_ONCE):
        yield slice(start, min(count, start + ROWS_AT_ONCE))


def _cells(column: Signal, rows: slice) -> list[object]:
    """Return some values as the csv module writes them: None as nothing, others as JSON has them."""
    values: list[object] = column.values[rows].tolist()
    if column.is_text:
        plain = (str, type(None))
        return [one if isinstance(one, plain) else orjson.dumps(one).decode() for one in values]
    return [None if value != value else value for value in values]  # NaN is unlike itself


def _write_mat(run: Run, path: Path) -> None:
    """One struct per signal with `time`, `value`, `unit` and `description`; all beside `run`."""
    from scipy.io import savemat

    contents: dict[str, Any] = {
        signal.name: {
            "time": run.time_s,
            "value": signal.values,
            "unit": signal.unit,
            "description": signal.description,
        }
        for signal in run.signals.values()
    }
    tables = all_columns(run)
    for name in ("samples", "events"):
        if name in tables:
            contents[name] = {column.name: _matlab_cells(column) for column in tables[name]}
    contents["run"] = {**run.metadata, "path": _shown(run.path), "tick_s": run.base.tick_s}
    with path.open("wb") as stream:
        # The library's own signature leaves out that it takes streams too.
        savemat(stream, contents, do_compression=True, oned_as="column")  # type: ignore[arg-type]


def _shown(path: Path) -> str:
    """Return a path as text, also where its bytes are none."""
    return os.fsencode(path).decode("utf-8", "backslashreplace")


def _matlab_cells(column: Signal) -> Any:
    if not column.is_text:
        return column.values
    return np.array(["" if value is None else value for value in column.values], dtype=object)


def _write_parquet(run: Run, folder: Path) -> None:
    """A file per table; units and meanings are metadata of the fields."""
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError as error:
        raise RecordingError(
            "Parquet needs pyarrow, which is not installed: pip install 'tenbaud[parquet]'."
        ) from error
    folder.mkdir()
    for name, columns in all_columns(run).items():
        arrays, fields = [], []
        for column in columns:
            values = column.values.tolist() if column.is_text else column.values
            # NaN stands for "not recorded"; other tools call that null.
            array = pyarrow.array(values, from_pandas=not column.is_text)
            arrays.append(array)
            about = {"unit": column.unit, "description": column.description}
            fields.append(pyarrow.field(column.name, array.type, metadata=about))
        schema = pyarrow.schema(fields, metadata=run.metadata)
        table = pyarrow.Table.from_arrays(arrays, schema=schema)
        with (folder / f"{name}.parquet").open("wb") as stream:
            parquet.write_table(table, stream, compression="zstd")


def _write_json(run: Run, path: Path) -> None:
    """The signals by name with unit, description and values; null where there is no value."""
    tables = all_columns(run)
    samples = {column.name: column for column in tables.get("samples", [])}
    with path.open("wb") as stream:
        about = {**run.metadata, "path": _shown(run.path), "tick_s": run.base.tick_s}
        stream.write(b'{"run":' + orjson.dumps(about) + b',"time_s":' + _json_values(run.time_s))
        stream.write(b',"signals":{')
        for number, signal in enumerate(run.signals.values()):
            facts = {"unit": signal.unit, "description": signal.description}
            stream.write(b"," if number else b"")
            stream.write(orjson.dumps(signal.name) + b":" + orjson.dumps(facts)[:-1] + b',"values":')
            stream.write(_json_values(signal.values) + b"}")
        stream.write(b'},"samples":{')
        for number, (name, column) in enumerate(samples.items()):
            stream.write(b"," if number else b"")
            stream.write(orjson.dumps(name) + b":" + _json_values(column.values))
        stream.write(b'},"events":' + orjson.dumps(run.events) + b"}")


def _json_values(values: NDArray[Any]) -> bytes:
    plain = values.tolist() if values.dtype == object else np.ascontiguousarray(values)
    return orjson.dumps(plain, option=orjson.OPT_SERIALIZE_NUMPY)


def _write_mcap(run: Run, path: Path) -> None:
    """One topic `flight` whose fields are the signals: a viewer needs no list and no second file."""
    from tenbaud.recording.writer import McapRecorder

    columns = flight_columns(run)
    channel = RecordChannel(
        "flight",
        tuple(
            Field(
                column.name,
                "integer" if column.name == "tick" else "number",
                column.unit,
                column.description,
            )
            for column in columns
        ),
    )
    tick_ns = run.base.tick_s * 1e9
    with McapRecorder(path, run.metadata, wait_when_full=True) as recorder:
        for part in _stretches(columns):
            for row in zip(*(column.values[part].tolist() for column in columns), strict=True):
                recorder.write(channel, round(row[0] * tick_ns), row)
    if isinstance(recorder.cause, OSError):
        raise recorder.cause
    if recorder.error is not None:
        raise RecordingError(recorder.error)


FORMS: dict[str, tuple[str, Callable[[Run, Path], None]]] = {
    "csv": ("csv", _write_csv),
    "mat": ("flight.mat", _write_mat),
    "parquet": ("parquet", _write_parquet),
    "json": ("flight.json", _write_json),
    "mcap": ("flight.mcap", _write_mcap),
}
"""Each form: its place in the folder of a run, and its writer."""
