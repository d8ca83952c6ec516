"""Recorded flights: encoder counts and applied voltages from a CSV file.

Both ends read the same file when a flight is replayed: the sensor node the counts, the controller
node the voltages. Nothing here runs while a flight runs, so it is no part of the codec.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator
from dataclasses import dataclass
from os import PathLike
from typing import Final

FilePath = str | PathLike[str]

_ROWS_MIN: Final = 2


class FlightLogError(ValueError):
    """A recorded flight that cannot be used; the message names file, line, column and fault."""


@dataclass(frozen=True, slots=True)
class FlightColumns:
    """The columns of the file.

    `index_column` counts the steps by ones from any start. `counts_columns` are encoder counts,
    one column per output, at least one. `volts_columns` are what was applied, in the order of the
    model's inputs; () for a file without them.
    """

    index_column: str = "step"
    counts_columns: tuple[str, ...] = ("pitch_counts",)
    volts_columns: tuple[str, ...] = ("right_volts", "left_volts")

    def __post_init__(self) -> None:
        """Refuse a choice of columns that measures nothing."""
        if not self.counts_columns:
            raise ValueError("counts_columns is (); it must name at least 1 column")


@dataclass(frozen=True, slots=True)
class FlightLog:
    """A recorded flight: row `k` holds the counts read, and the voltages applied, at step `k`.

    `counts[k]` has one entry per counts column; `volts[k]` one per volts column, () without any.
    """

    counts: tuple[tuple[int, ...], ...]
    volts: tuple[tuple[float, ...], ...]

    def __len__(self) -> int:
        """Return the number of steps."""
        return len(self.counts)

    @classmethod
    def read(cls, path: FilePath, columns: FlightColumns | None = None) -> FlightLog:
        """Read the whole file at `path`; `columns` defaults to `FlightColumns()`.

        Raises FlightLogError for an unreadable file, a missing column, a cell that is empty, not a
        number or not finite, a gap or repeat in the index, and for fewer than 2 rows.
        """
        columns = columns or FlightColumns()
        names = (columns.index_column, *columns.counts_columns, *columns.volts_columns)
        volts_start = 1 + len(columns.counts_columns)
        counts: list[tuple[int, ...]] = []
        volts: list[tuple[float, ...]] = []
        expected: int | None = None
        for line, cells in read_columns(path, names):
            index = _parse_whole(cells[0], path, line, names[0])
            if expected is not None and index != expected:
                raise FlightLogError(
                    f"{path}, line {line}, column {names[0]}: {index} found, {expected} expected; "
                    "steps must follow each other without a gap or a repeat"
                )
            expected = index + 1
            named = list(zip(names, cells, strict=True))
            counts.append(
                tuple(_parse_whole(cell, path, line, name) for name, cell in named[1:volts_start])
            )
            volts.append(
                tuple(parse_number(cell, path, line, name) for name, cell in named[volts_start:])
            )
        if len(counts) < _ROWS_MIN:
            raise FlightLogError(
                f"{path}, line {len(counts) + 1}: the file ends after {len(counts)} rows; "
                f"a flight needs at least {_ROWS_MIN}"
            )
        return cls(tuple(counts), tuple(volts))


def column_names(path: FilePath) -> list[str]:
    """Return the names in the first line; none where it cannot be read: `read_columns` says why."""
    try:
        with open(path, newline="", encoding="utf-8-sig") as file:
            return [cell.strip() for cell in next(csv.reader(file), [])]
    except (OSError, UnicodeDecodeError, csv.Error):
        return []


def read_columns(path: FilePath, names: tuple[str, ...]) -> Iterator[tuple[int, tuple[str, ...]]]:
    """Yield the line number and the cells under `names`, in their order, of every row.

    The first line is the header; other columns are ignored and empty lines skipped. Raises
    FlightLogError for a file that cannot be read as text, a missing or doubled column, and a row
    whose number of cells is not the header's.
    """
    line = 1
    try:
        # utf-8-sig: spreadsheet programs put a byte order mark before the first column's name.
        with open(path, newline="", encoding="utf-8-sig") as file:
            reader = csv.reader(file)
            header = [cell.strip() for cell in next(reader, [])]
            positions = [_position(name, header, path) for name in names]
            for row in reader:
                line = reader.line_num
                if not row:
                    continue
                if len(row) != len(header):
                    raise FlightLogError(
                        f"{path}, line {line}: {len(row)} cells found, {len(header)} expected"
                    )
                yield line, tuple(row[position].strip() for position in positions)
    except OSError as error:
        raise FlightLogError(f"{path}: cannot be read: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise FlightLogError(f"{path}, after line {line}: not UTF-8 text") from error
    except csv.Error as error:
        raise FlightLogError(f"{path}, after line {line}: not a CSV file: {error}") from error


def parse_number(cell: str, path: FilePath, line: int, column: str) -> float:
    """Return the finite number in `cell`; FlightLogError names `path`, `line` and `column`."""
    try:
        # Python alone reads 1_000 as a number; no other program that touches the file would.
        value = float("_" if "_" in cell else cell)
    except ValueError:
        fault = f"'{cell}' is not a number" if cell else "empty cell"
        raise FlightLogError(f"{path}, line {line}, column {column}: {fault}") from None
    if not math.isfinite(value):
        raise FlightLogError(f"{path}, line {line}, column {column}: '{cell}' is not finite")
    return value


def _parse_whole(cell: str, path: FilePath, line: int, column: str) -> int:
    value = parse_number(cell, path, line, column)
    # Above 2^53 a float no longer holds every whole number, and no encoder counts that far.
    if not value.is_integer() or abs(value) > 2**53:
        raise FlightLogError(
            f"{path}, line {line}, column {column}: '{cell}' is not a whole number within +-2^53"
        )
    return int(value)


def _position(name: str, header: list[str], path: FilePath) -> int:
    found = header.count(name)
    if found != 1:
        fault = "missing" if not found else f"there {found} times"
        present = ", ".join(header) or "none"
        raise FlightLogError(f"{path}, line 1: column {name} is {fault}; present: {present}")
    return header.index(name)
