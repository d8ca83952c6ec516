"""Tables of text, read by pandas in chunks of rows, of which only the wanted columns stay."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from tenbaud.log.dialect import DATE, MIXED, Dialect, find_dialect
from tenbaud.log.table import Array, LogError, Table, Wanted, export_roles
from tenbaud.log.units import DATE_TIME

if TYPE_CHECKING:
    import pandas as pd

CHUNK_ROWS = 100_000
FAULTS_MAX = 5
DAY_FIRST = {"": (False,), ".": (True,), "/": (False, True)}
"""Readings of a date by what separates day and month; of two, the one whose times rise is taken."""
_DAY_OR_MONTH = re.compile(r"\d\d?([./])")
_EXPONENTS = {"d": "e", "D": "E"}


def read_text(path: Path, wanted: Wanted | None = None) -> Table:
    """Return the table in a file of text; LogError where there is none."""
    dialect = find_dialect(path)
    names, units = dialect.names, list(dialect.units)
    places = list(wanted(names, units, export_roles(names, units)) if wanted else range(len(names)))
    columns = [_Column(names[place], place, dialect.decimal) for place in places]
    for chunk in _chunks(path, dialect):
        for column in columns:
            column.take(chunk[column.place])
    for column in columns:
        if column.began:
            units[column.place] = DATE_TIME
    # Spreadsheet programs write rows of separators below a table.
    rows = max([column.used for column in columns], default=0)
    return Table(
        str(path),
        dialect.description,
        tuple([names[place] for place in places]),
        tuple([units[place] for place in places]),
        tuple([column.values()[:rows] for column in columns]),
        _places(path, dialect),
        {column.name: tuple(column.faults) for column in columns if column.faults},
        roles=export_roles(names, units),
    )


class _Column:
    """One column as it is read."""

    def __init__(self, name: str, place: int, decimal: str) -> None:
        self.name, self.place = name, place
        # A point among decimal commas is no decimal sign: 1.234,5.
        self._signs = str.maketrans(_EXPONENTS | ({",": ".", ".": ","} if decimal == "," else {}))
        self.faults: list[tuple[int, str]] = []
        self.began: dict[bool, pd.Timestamp] = {}
        """first time of a column of dates, by whether the day comes first"""
        self.used = 0
        """rows up to the last cell that is not empty"""
        self._parts: list[Array] = []
        self._rows = 0

    def take(self, cells: pd.Series[Any]) -> None:
        import pandas as pd

        if cells.dtype.kind in "biuf" and not self.began:
            values = cells.to_numpy(np.float64)
            filled = np.flatnonzero(~np.isnan(values))
        else:
            texts = cells.astype(str).str.strip()
            head = str(texts.iloc[0]) if len(texts) and not self._rows else ""
            if DATE.fullmatch(head):
                found = _DAY_OR_MONTH.match(head)
                for day_first in DAY_FIRST[found[1] if found else ""]:
                    first: Any = pd.to_datetime(head, errors="coerce", dayfirst=day_first, utc=True)
                    if first is not pd.NaT:
                        self.began[day_first] = first
            if self.began:
                values = np.stack([_seconds(texts, *one) for one in self.began.items()])
            else:
                numbers = pd.to_numeric(texts.str.translate(self._signs), errors="coerce")
                values = numbers.to_numpy(np.float64)
            filled = np.flatnonzero(cells.notna().to_numpy())
            bad = np.flatnonzero(np.isnan(np.atleast_2d(values)).any(axis=0) & cells.notna().to_numpy())
            for row in bad[: FAULTS_MAX - len(self.faults)].tolist():
                self.faults.append((self._rows + row, str(texts.iloc[row])))
        if len(filled):
            self.used = self._rows + int(filled[-1]) + 1
        self._parts.append(values)
        self._rows += len(cells)

    def values(self) -> Array:
        """Return all cells; the parts are given up."""
        whole = np.concatenate(self._parts, axis=-1) if self._parts else np.empty(0)
        self._parts = []
        return min(whole, key=_unrest) if self.began else whole


def _seconds(texts: pd.Series[str], day_first: bool, began: pd.Timestamp) -> Array:
    import pandas as pd

    times = pd.to_datetime(texts, errors="coerce", format="mixed", dayfirst=day_first, utc=True)
    return np.asarray((times - began).dt.total_seconds(), dtype=np.float64)


def _unrest(times: Array) -> tuple[int, float]:
    """Return how often times run back, and their largest step."""
    steps = np.diff(times[np.isfinite(times)])
    return int(np.sum(steps < 0.0)), float(np.max(steps, initial=0.0))


def _chunks(path: Path, dialect: Dialect) -> Any:
    import pandas as pd

    try:
        with pd.read_csv(
            path,
            sep=r"\s+" if dialect.separator == " " else dialect.separator,
            header=None,
            names=range(len(dialect.names)),
            index_col=False,
            skiprows=dialect.skipped,
            skip_blank_lines=True,
            skipinitialspace=True,
            comment=dialect.one_comment or None,
            decimal=dialect.decimal,
            encoding=dialect.encoding,
            encoding_errors="replace",
            keep_default_na=False,
            na_values=[""],
            chunksize=CHUNK_ROWS,
            low_memory=False,  # numbers and texts in one column would be found out piece by piece
        ) as chunks:
            yield from chunks
    except pd.errors.EmptyDataError:
        return
    except (pd.errors.ParserError, UnicodeError) as error:
        text = str(error).removeprefix("Error tokenizing data. C error: ").strip()
        if found := re.search(r"Expected (\d+) fields in line (\d+), saw (\d+)", text):
            problem = f"{found[3]} cells found, {found[1]} expected; {MIXED}"
            raise LogError(f"{path}, line {found[2]}: {problem}") from error
        raise LogError(f"{path}: no table: {text[:1].lower()}{text[1:]}") from error


def _places(path: Path, dialect: Dialect) -> Callable[[int], str]:
    """Return the function from a row to its line: it counts the file's lines when an error needs it."""

    def place(row: int) -> str:
        rows = -1
        with path.open(encoding=dialect.encoding, errors="replace") as file:
            for number, line in enumerate(file, 1):
                commented = dialect.one_comment and line.lstrip().startswith(dialect.one_comment)
                if number > dialect.skipped and line.strip() and not commented:
                    rows += 1
                if rows == row:
                    return f"line {number}"
        return f"row {row + 1}"

    return place
