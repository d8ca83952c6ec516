"""How a text file writes its table: found from its first lines."""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path
from statistics import median_low

from tenbaud.log.table import LogError
from tenbaud.log.units import split_unit, unit_named

SAMPLE_BYTES = 1 << 16
LINE_END = re.compile(r"\r\n|\n|\r")
COMMENTS = ("#", "%", "//")
MIXED = "are decimal signs or separators mixed?"
_SEPARATORS = {",": "commas", ";": "semicolons", "\t": "tabs", " ": "blanks"}
_NUMBERS = {
    decimal: re.compile(
        rf"[+-]?(\d+({decimal}\d*)?|{decimal}\d+)([eEdD][+-]?\d+)?|[+-]?(nan|inf)", re.I
    )
    for decimal in (r"\.", ",")
}
DATE = re.compile(r"\d{4}-\d\d?-\d\d?([T ].*)?|\d\d?[./]\d\d?[./]\d{4}.*|\d\d?:\d\d(:\d\d.*)?")
_OTHERS = {
    b"PK\x03\x04": "an Excel or zip file; save the sheet as CSV",
    b"\xd0\xcf\x11\xe0": "an old Excel file; save the sheet as CSV",
    b"\x1f\x8b": "compressed; unpack it first",
    b"%PDF": "a PDF",
}


@dataclass(frozen=True)
class Dialect:
    """The arguments of `pandas.read_csv` for a file."""

    encoding: str
    separator: str
    decimal: str
    comment: str
    """start of a comment line; "" without any"""
    skipped: int
    """lines above the first row"""
    names: tuple[str, ...]
    units: tuple[str, ...]
    note: str = ""
    """on a header that is shorter than the rows"""

    @property
    def one_comment(self) -> str:
        """The sign of comment lines below the first row; pandas knows single letters only."""
        return self.comment if len(self.comment) == 1 else ""

    @property
    def description(self) -> str:
        decimals = ", decimal commas" if self.decimal == "," else ""
        return f"text, {_SEPARATORS[self.separator]}{decimals}, {self.encoding}{self.note}"


def find_dialect(path: Path) -> Dialect:
    """Return how a file is written; LogError where it is no table of text."""
    try:
        with path.open("rb") as file:
            head = file.read(SAMPLE_BYTES)
    except OSError as error:
        raise LogError(f"{path}: cannot be read: {error.strerror}") from error
    encoding, text = _decoded(path, head)
    lines = LINE_END.split(text)
    if len(head) == SAMPLE_BYTES and len(lines) > 1:
        lines.pop()  # cut off in the middle
    comment = next((one for one in COMMENTS for line in lines if line.lstrip().startswith(one)), "")
    numbered = [
        (at, line)
        for at, line in enumerate(lines)
        if line.strip() and not line.lstrip().startswith(COMMENTS)
    ]
    if not numbered:
        raise LogError(f"{path}, line 1: the file is empty; a log needs a header and rows of numbers")
    separator, decimal = _separator([line for _, line in numbered])
    rows = [(at, split_line(line, separator)) for at, line in numbered]
    first = _first_row([row for _, row in rows], decimal)
    above = [row for _, row in rows[:first]]
    skipped = rows[first][0] if first < len(rows) else len(lines)
    if not above and skipped and comment:
        # numpy.savetxt writes the header as a comment.
        above = [split_line(lines[skipped - 1].lstrip().removeprefix(comment).strip(), separator)]
        if len(above[0]) != len(rows[0][1]):
            above = []
    width = median_low([len(row) for _, row in rows[first:]] or [0])
    note = ""
    if above and 0 < (named := len(above[-1])) < width:
        note = f"; the header names {named} of {width} columns, taken as the first ones"
        if named == width - 1 and _counts_rows([line for _, line in numbered[first:]], rows[first:]):
            above = [["", *row] for row in above]
            note = "; the header has no name for the first column, which names or counts the rows"
    names, units = _header(above, width)
    if first < len(rows) and (found := len(rows[first][1])) > len(names):
        raise LogError(
            f"{path}, line {skipped + 1}: {found} cells found, {len(names)} expected; {MIXED}"
        )
    return Dialect(encoding, separator, decimal, comment, skipped, names, units, note)


def _counts_rows(lines: list[str], rows: list[tuple[int, list[str]]]) -> bool:
    """Return whether rows begin with their names in quotes, or with 1, 2, 3 ..., as R writes them."""
    counted = all(row[:1] == [str(number)] for number, (_, row) in enumerate(rows, 1))
    return counted or all(line.lstrip().startswith('"') for line in lines)


def split_line(line: str, separator: str) -> list[str]:
    """Return the cells of a line."""
    if separator == " ":
        cells = next(csv.reader([" ".join(line.split())], delimiter=" "), [])
    else:
        cells = next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])
    return [cell.strip() for cell in cells]


def _decoded(path: Path, head: bytes) -> tuple[str, str]:
    for magic, what in _OTHERS.items():
        if head.startswith(magic):
            raise LogError(f"{path} is {what}")
    if head.startswith((b"\xff\xfe", b"\xfe\xff")):
        return "utf-16", head[: len(head) & ~1].decode("utf-16", errors="replace")
    if b"\0" in head:
        raise LogError(f"{path} is not text, and no format of a log that is known; export it as CSV")
    if head.startswith(b"\xef\xbb\xbf"):
        return "utf-8-sig", head.decode("utf-8-sig", errors="replace")
    try:
        # A character may be cut at the sample's end.
        return "utf-8", (head[:-4] if len(head) == SAMPLE_BYTES else head).decode("utf-8")
    except UnicodeDecodeError:
        return "latin-1", head.decode("latin-1")


def is_number(cell: str, decimal: str) -> bool:
    """Return whether a cell is a number."""
    return _NUMBERS["," if decimal == "," else r"\."].fullmatch(cell) is not None


def _separator(lines: list[str]) -> tuple[str, str]:
    """Return separator and decimal sign: those that make most cells numbers, in rows of one length."""
    sample = lines[-100:]
    best, chosen = -1.0, (",", ".")
    for separator in _SEPARATORS:
        rows = [split_line(line, separator) for line in sample]
        usual = median_low(len(row) for row in rows)
        even = sum(len(row) == usual for row in rows) / len(rows)
        for decimal in (".", ","):
            if decimal == separator:
                continue
            cells = [cell for row in rows for cell in row]
            good = sum(is_number(cell, decimal) or not cell for cell in cells) / max(1, len(cells))
            score = even * good + (0.01 if usual > 1 else 0.0)
            if score > best + 1e-9:
                best, chosen = score, (separator, decimal)
    return chosen


def _first_row(rows: list[list[str]], decimal: str) -> int:
    """Return the place of the first row of numbers."""
    numbers = [
        sum(is_number(cell, decimal) or bool(DATE.fullmatch(cell)) for cell in row) for row in rows
    ]
    usual = median_low(numbers[-100:])
    for at, count in enumerate(numbers):
        if count and 2 * count >= usual:
            return at
    return len(rows)


def _header(above: list[list[str]], width: int) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return names and units of `width` columns from the lines above the first row."""
    given: list[str] = []
    if len(above) > 1 and all(
        unit_named(cell) or cell.strip("-[]() ") in ("", "1") for cell in above[-1]
    ):
        given = [unit_named(cell) for cell in above.pop()]
    header = above[-1] if above else []
    names: list[str] = []
    for at, (name, _) in enumerate(zip_longest(header, range(width), fillvalue=""), 1):
        names.append(str(name) or str(at))
    doubled = {name for name in names if names.count(name) > 1}
    units = [unit or split_unit(name)[1] for name, unit in zip_longest(names, given, fillvalue="")]
    unique = [f"{name} [{at}]" if name in doubled else name for at, name in enumerate(names, 1)]
    return tuple(unique), tuple(units[: len(names)])
