"""Tables of text, read by pandas in chunks of rows, of which only the wanted columns stay."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from tenbaud.log.dialect import DATE, Dialect, find_dialect
from tenbaud.log.export import export_roles
from tenbaud.log.table import Array, LogError, Table, Wanted
from tenbaud.log.units import DATE_TIME

if TYPE_CHECKING:
    import pandas as pd

CHUNK_ROWS = 100_000
FAULTS_MAX = 5


def read_text(path: Path, wanted: Wanted | None = None) -> Table:
    """Return the table in a file of text; LogError where there is none."""
    dialect = find_dialect(path)
    names, units = dialect.names, list(dialect.units)
    places = list(wanted(names, units, export_roles(names, units)) if wanted else range(len(names)))
    columns = [_Column(names[place], place) for place in places]
    for chunk in _chunks(path, dialect):
        for column in columns:
            column.take(chunk[column.place])
    for column in columns:
        if column.began is not None:
            units[column.place] = DATE_TIME
    # Spreadsheet programs write rows of separators below a table.
    rows = max([column.used for column in columns], default=0)
    return Table(
        str(path),
        dialect.told,
        tuple([names[place] for place in places]),
        tuple([units[place] for place in places]),
        tuple([column.values()[:rows] for column in columns]),
        _places(path, dialect),
        {column.name: tuple(column.faults) for column in columns if column.faults},
        roles=export_roles(names, units),
    )


class _Column:
    """One column as it is read."""

    def __init__(self, name: str, place: int) -> None:
        self.name, self.place = name, place
        self.faults: list[tuple[int, str]] = []
        self.began: pd.Timestamp | None = None
        """first time of a column of dates"""
        self.used = 0
        """rows up to the last cell that is not empty"""
        self._parts: list[Array] = []
        self._rows = 0

    def take(self, cells: pd.Series[Any]) -> None:
        """Add the cells of a chunk."""
        import pandas as pd

        if cells.dtype.kind in "biuf":
            values = cells.to_numpy(np.float64)
            filled = np.flatnonzero(~np.isnan(values))
        else:
            texts = cells.astype(str).str.strip()
            if self.began is None and not self._rows and len(texts) and DATE.fullmatch(texts.iloc[0]):
                first: Any = pd.to_datetime(texts.iloc[0], errors="coerce")
                self.began = None if first is pd.NaT else first
            if self.began is not None:
                times = pd.to_datetime(texts, errors="coerce", format="mixed")
                values = (times - self.began).dt.total_seconds().to_numpy(np.float64)
            else:
                values = pd.to_numeric(texts, errors="coerce").to_numpy(np.float64)
            filled = np.flatnonzero(cells.notna().to_numpy())
            bad = np.flatnonzero(np.isnan(values) & cells.notna().to_numpy())
            for row in bad[: FAULTS_MAX - len(self.faults)].tolist():
                self.faults.append((self._rows + row, str(texts.iloc[row])))
        if len(filled):
            self.used = self._rows + int(filled[-1]) + 1
        self._parts.append(values)
        self._rows += len(values)

    def values(self) -> Array:
        """Return all cells; the parts are given up."""
        whole = np.concatenate(self._parts) if self._parts else np.empty(0)
        self._parts = []
        return whole


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
        ) as chunks:
            yield from chunks
    except pd.errors.EmptyDataError:
        return
    except (pd.errors.ParserError, UnicodeError) as error:
        text = str(error).removeprefix("Error tokenizing data. C error: ").strip()
        if found := re.search(r"Expected (\d+) fields in line (\d+), saw (\d+)", text):
            raise LogError(
                f"{path}, line {found[2]}: {found[3]} cells found, {found[1]} expected; are decimal "
                "signs or separators mixed?"
            ) from error
        raise LogError(f"{path}: no table: {text[:1].lower()}{text[1:]}") from error


def _places(path: Path, dialect: Dialect) -> Callable[[int], str]:
    """Return what finds the line of a row: it counts the lines of the file, when an error asks."""

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
