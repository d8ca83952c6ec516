"""The table into which every format of a log is read."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from pathlib import Path

import numpy as np
import numpy.typing as npt

from channel.codec.signals import unit_suffix
from channel.errors import TenbaudError
from tenbaud.log.units import bare_name, stem_of

Array = npt.NDArray[np.float64]
Wanted = Callable[[Sequence[str], Sequence[str], Mapping[str, str]], Sequence[int]]
"""Names, units and roles of all columns to the places of those that are read."""


class LogError(TenbaudError, ValueError):
    """A log that cannot be used; the text names file, line, column and the next step."""


@contextmanager
def unreadable(path: Path, kind: str, advice: str = "") -> Iterator[None]:
    """Raise LogError where a library fails at a file: on a corrupt one it raises anything."""
    try:
        yield
    except LogError:
        raise
    except Exception as error:
        why = " ".join(str(error).split()) or type(error).__name__
        raise LogError(f"{path} cannot be read as {kind}: {why}. {advice}".rstrip()) from error


@dataclass(frozen=True)
class Table:
    """The columns of a file that were asked for, as numbers."""

    path: str
    source: str
    """such as "CSV text, semicolons, decimal commas, latin-1" """
    names: tuple[str, ...]
    """unique; the number of the column, from 1, where it has no name"""
    units: tuple[str, ...]
    """as the file gives them; "" unknown"""
    columns: tuple[Array, ...]
    """NaN where a cell is empty or no number"""
    place: Callable[[int], str] = lambda row: f"row {row + 1}"
    """row to where it is in the file, for people: "line 12" """
    faults: Mapping[str, tuple[tuple[int, str], ...]] = field(default_factory=dict)
    """column to its first cells that are no number: row and text"""
    period_s: float | None = None
    """where the format itself knows it"""
    roles: Mapping[str, str] = field(default_factory=dict)
    """where the format itself knows: "time", "index", or the name of a signal, to a column"""

    def __len__(self) -> int:
        return len(self.columns[0]) if self.columns else 0

    def find(self, wanted: str) -> int:
        return find_column(self.path, self.names, wanted)

    def only(self, wanted: Wanted | None) -> Table:
        """Return the table with the wanted columns alone; with all of them where nothing chooses."""
        if wanted is None:
            return self
        places = wanted(self.names, self.units, self.roles)
        return replace(
            self,
            names=tuple([self.names[place] for place in places]),
            units=tuple([self.units[place] for place in places]),
            columns=tuple([self.columns[place] for place in places]),
        )

    def fault(self, row: int, column: int, what: str) -> LogError:
        """Return the error of one cell."""
        return LogError(f"{self.path}, {self.place(row)}, column {self.names[column]}: {what}")

    def check(self, column: int, rows: slice = slice(None)) -> Array:
        """Return the values of a column; LogError for the first that is no finite number."""
        values = self.columns[column][rows]
        bad = np.flatnonzero(~np.isfinite(values))
        if not len(bad):
            return values
        row = int(bad[0]) + (rows.start or 0)
        text = dict(self.faults.get(self.names[column], ())).get(row, "")
        found = self.columns[column][row]
        if np.isinf(found):
            text = text or str(found)
        problem = f"'{text}' is not a finite number" if text else "empty cell"
        if not np.isinf(found) and text:
            problem = f"'{text}' is not a number"
        raise self.fault(row, column, f"{problem}; correct it, or leave it out with --from and --to")


def find_column(path: str, names: Sequence[str], wanted: str) -> int:
    """Return the place of a column by its name, its name without unit, or its number from 1.

    LogError lists the columns.
    """
    if names.count(wanted) == 1:
        return names.index(wanted)
    for simpler in (str.strip, str.casefold, lambda name: bare_name(name).casefold()):
        found = [place for place, name in enumerate(names) if simpler(name) == simpler(wanted)]
        if len(found) == 1:
            return found[0]
        if found:
            numbers = " or ".join(str(place + 1) for place in found)
            raise LogError(
                f"{path}: column {wanted} is there {len(found)} times; give its number, {numbers}"
            )
    if wanted.isdigit() and 1 <= int(wanted) <= len(names):
        return int(wanted) - 1
    close = get_close_matches(wanted, names, n=1)
    meant = f" (did you mean {close[0]}?)" if close else ""
    raise LogError(f"{path}: column {wanted} is missing{meant}; present: {listed(names)}")


def listed(names: Sequence[str]) -> str:
    """Return the columns with their numbers, for people."""
    shown = [f"{at} {name}" if name != str(at) else name for at, name in enumerate(names[:40], 1)]
    return ", ".join(shown) + (f" and {len(names) - 40} more" if len(names) > 40 else "") or "none"


def export_roles(names: Sequence[str], units: Sequence[str]) -> Mapping[str, str]:
    """Return the measured and applied columns of an exported flight; {} for another file.

    Keys are `time`, `out:NAME` and `in:NAME`. A unit is the end of a column's name in some forms.
    """
    plain = [
        name.removesuffix(f"_{unit_suffix(unit)}") if unit else name
        for name, unit in zip(names, units, strict=True)
    ]
    if not any(one.startswith("error_coded") for one in plain) or stem_of(names[0]) not in (
        "tick",
        "time",
    ):
        return {}
    roles = {"time": names[1] if names[0] == "tick" else names[0]}
    for at, name in enumerate(plain):
        if name == "measured":  # of the only output, which is beside it
            roles[f"out:{plain[at - 1]}"] = names[at]
        elif name.removeprefix("measured_") in plain and name.startswith("measured_"):
            roles[f"out:{name.removeprefix('measured_')}"] = names[at]
        elif f"{name}_command" in plain:
            roles[f"in:{name}"] = names[at]
    return roles
