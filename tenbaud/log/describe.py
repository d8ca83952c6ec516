"""The content of a log, for the person who assigns its columns."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np

from channel.flight_log import FlightLog
from tenbaud.config.schema import FlightLogSection
from tenbaud.log.beside import with_file_beside
from tenbaud.log.clock import GAP, shown
from tenbaud.log.join import table_of
from tenbaud.log.look import Look, looks_of
from tenbaud.log.read import read_log
from tenbaud.log.reader import read_table
from tenbaud.log.suggest import Suggestion, suggest
from tenbaud.log.table import Array, LogError, Table
from tenbaud.log.units import DATE_TIME, factor

PLACES_MAX = 3


@dataclass(frozen=True, slots=True)
class Sampling:
    """How the rows lie in time, before anything is cut or resampled."""

    step_s: float
    first_s: float
    last_s: float
    jitter_s: float
    """largest deviation of a step from the usual one, gaps apart"""
    gaps: int
    repeats: int
    """rows whose time is that of the row before, or earlier"""
    places: tuple[str, ...]
    """the first of these rows"""

    @property
    def words(self) -> str:
        jitter = f"jitter up to {100.0 * self.jitter_s / self.step_s:.2g} % of it"
        even = "even" if self.jitter_s < 0.001 * self.step_s else jitter
        text = (
            f"{1.0 / self.step_s:.6g} Hz, a row every {self.step_s:.6g} s ({even}), "
            f"from {shown(self.first_s, self.step_s)} to {shown(self.last_s, self.step_s)} s"
        )
        faults = [("gaps", self.gaps), ("times that do not rise", self.repeats)]
        counted = [f"{what}: {count}" for what, count in faults if count]
        return "; ".join([text, *counted]) + (f" ({', '.join(self.places)})" if counted else "")


@dataclass(frozen=True, slots=True)
class Description:
    """All that is said about a log."""

    source: str
    rows: int
    looks: tuple[Look, ...]
    sampling: Sampling | None
    suggestion: Suggestion
    log: FlightLog | None
    """as it is read with that section"""
    problem: str
    """why it cannot be read; empty: it can"""

    @property
    def taken_as(self) -> dict[str, str]:
        """The signal that each column is taken as."""
        return {column: signal for signal, column in self.suggestion.taken.items()}

    def as_json(self) -> dict[str, Any]:
        columns = [
            {
                "number": number,
                "name": one.name,
                "unit": one.unit,
                "unit_guessed": one.guess,
                "lowest": None if math.isnan(one.lowest) else one.lowest,
                "highest": None if math.isnan(one.highest) else one.highest,
                "missing": one.missing,
                "looks_like": one.kind,
                "taken_as": self.taken_as.get(one.name, ""),
            }
            for number, one in enumerate(self.looks, start=1)
        ]
        timing = self.sampling
        return {
            "source": self.source,
            "rows": self.rows,
            "columns": columns,
            "sampling": None
            if timing is None
            else {name: getattr(timing, name) for name in Sampling.__slots__},
            "tick_s": None if self.log is None else self.log.tick_s,
            "notes": [] if self.log is None else list(self.log.notes),
            "problem": self.problem,
            "options": self.suggestion.section.model_dump(exclude_defaults=True, exclude={"file"}),
            "commands": self.suggestion.commands(beside=False),
        }

    def as_text(self, beside: bool = False) -> str:
        """Return it for people; `beside`: the options are kept in a file beside the log."""
        lines = [f"{self.source}; {self.rows} rows", "", *self._columns(), ""]
        if self.sampling is not None:
            lines.append(f"Sampling: {self.sampling.words}.")
        if self.log is not None:
            notes = [note for note in self.log.notes if note != self.source]
            lines += [f"Read as: {len(self.log)} rows {self.log.tick_s:g} s apart."]
            lines += [f"  {note}" for note in notes]
        if self.suggestion.others:
            others = ", ".join(self.suggestion.others)
            lines.append(f"Other outputs: {others}; --columns angle=NAME takes one.")
        if self.problem:
            lines.append(f"Cannot be used yet: {self.problem}")
        lines += ["", "Next:" if not self.problem else "Next, once that is set right:"]
        return "\n".join(lines + [f"  {one}" for one in self.suggestion.commands(beside)])

    def _columns(self) -> list[str]:
        rows = [("", "column", "unit", "lowest", "highest", "looks like", "taken as")]
        for number, one in enumerate(self.looks, start=1):
            unit = f"{one.unit}?" if one.guess else one.unit
            empty = f", {one.missing} empty cells" if one.missing and one.kind != "empty" else ""
            because = f" ({one.guess})" if one.guess and one.kind in ("signal", "counts") else ""
            low, high = ("" if math.isnan(end) else f"{end:.6g}" for end in (one.lowest, one.highest))
            words, taken = f"{one.words}{empty}{because}", self.taken_as.get(one.name, "")
            rows.append((str(number), one.name, unit, low, high, words, taken))
        widths = [max(len(row[place]) for row in rows) for place in range(len(rows[0]))]
        padded = [[cell.ljust(width) for cell, width in zip(row, widths, strict=True)] for row in rows]
        return ["  ".join(row).rstrip() for row in padded]


def describe(section: FlightLogSection) -> tuple[Description, Table]:
    """Return the description of a section's log, and its columns. LogError: it holds no table."""
    section = with_file_beside(section)
    kept = cache(read_table)
    table, _ = table_of(section, lambda path, _: kept(path))
    looks = looks_of(table)
    suggestion = suggest(section, table, looks)
    section = suggestion.section
    read = [suggestion.taken.get(role) for role in ("time", "angle", "output")]
    looks = [
        replace(one, unit="", guess="") if one.guess and one.name not in read else one for one in looks
    ]
    log, problem = None, ""
    try:
        log = read_log(section, None, read=lambda path, wanted: kept(path).only(wanted))
    except LogError as error:
        problem = str(error).removeprefix(section.file).lstrip(",: ")
    found = Description(
        table.source,
        len(table),
        tuple(looks),
        _sampling(clock_of(suggestion, table), table),
        suggestion,
        log,
        problem,
    )
    return found, table


def clock_of(suggestion: Suggestion, table: Table) -> Array | None:
    """Return the times of the rows in seconds as the file has them; None without a clock."""
    name = suggestion.taken.get("time", "")
    if name not in table.names:
        return None
    place = table.names.index(name)
    unit = suggestion.section.units.get("time") or table.units[place]
    by = 1.0 if unit == DATE_TIME else factor(unit, "s") or 1.0
    return by * table.columns[place]


def _sampling(times: Array | None, table: Table) -> Sampling | None:
    if times is None:
        return None
    rows = np.flatnonzero(np.isfinite(times))
    times = times[rows]
    if len(times) < 2 or np.median(np.diff(times)) <= 0.0:
        return None
    steps = np.diff(times)
    usual = float(np.median(steps))
    gaps = np.flatnonzero(steps > GAP * usual)
    back = np.flatnonzero(steps <= 0.0)
    sound = (steps > 0.0) & (steps <= GAP * usual)
    sound[1:] &= steps[:-1] > 0.0  # the step behind a repeat makes up for it
    within = steps[sound]
    return Sampling(
        usual,
        float(times[0]),
        float(times[-1]),
        float(np.max(np.abs(within - usual), initial=0.0)),
        len(gaps),
        len(back),
        tuple([table.place(int(rows[at + 1])) for at in sorted({*gaps, *back})[:PLACES_MAX]]),
    )
