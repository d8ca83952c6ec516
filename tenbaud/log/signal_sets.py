"""Variables as tables: those of one clock are a set, and a table holds one set."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from tenbaud.log.table import Array, LogError, Table, Wanted, export_roles
from tenbaud.log.variables import ROWS_MIN, Clock, Variable, rows_first

PARAMETER_SHARE = 0.05
"""Arrays without a clock that are shorter than this share of the longest are parameters."""
LISTED_MAX = 6


@dataclass(slots=True)
class _Group:
    """The variables of one clock, or of one length where there is no clock."""

    rows: int
    clock: Clock | None
    members: list[tuple[Variable, Array]] = field(default_factory=list)

    def takes(self, rows: int, clock: Clock | None) -> bool:
        if self.rows != rows or clock is None or self.clock is None:
            return self.rows == rows and clock is self.clock
        return np.array_equal(self.clock.values, clock.values)


def table_of(
    path: Path, kind: str, variables: Iterable[Variable], wanted: Wanted | None = None
) -> Table:
    """Return the variables of one clock as a table.

    A file with several clocks, or vectors of several lengths, is ambiguous unless all `wanted` columns
    are in one of these sets. LogError names the variables and the option that chooses.
    """
    groups, left_out = _groups(list(variables))
    tables = [(group, _table(path, group)) for group in groups]
    chosen = _chosen(path, tables, left_out, wanted)
    left_out = [_listed(one) for group, one in tables if group is not chosen[0]] + left_out
    left = f"; left out: {', '.join(left_out[:LISTED_MAX])}" if left_out else ""
    one = chosen[1]
    columns = tuple([np.ascontiguousarray(column) for column in one.columns])
    return replace(one, source=f"{kind}: {one.source}{left}", columns=columns)


def flat_table(
    path: Path,
    source: str,
    units: Mapping[str, str],
    read: Callable[[str], Array],
    wanted: Wanted | None = None,
) -> Table:
    """Return a table whose columns `read` gives by name, the wanted ones alone; `units` names all."""
    names = list(units)
    roles = export_roles(names, list(units.values()))
    places = range(len(names)) if wanted is None else wanted(names, list(units.values()), roles)
    chosen = [names[place] for place in places]
    return Table(
        str(path),
        source,
        tuple(chosen),
        tuple([units[name] for name in chosen]),
        tuple([read(name) for name in chosen]),
        roles=roles,
    )


def _groups(variables: list[Variable]) -> tuple[list[_Group], list[str]]:
    """Return the variables by clock, those without one with the vectors of their length."""
    groups: list[_Group] = []
    left_out = []
    table: list[tuple[Variable, Array]] = []
    for one in variables:
        rows = len(one.clock.values) if one.clock is not None else None
        turned = rows_first(one.values, rows)
        if turned is None and rows is not None:
            one = Variable(one.name, one.values, one.unit)  # of another length than the clock beside it
            turned = rows_first(one.values, None)
        if turned is None:
            left_out.append(f"{one.name} ({'x'.join(map(str, one.values.shape))})")
        elif len(turned) < ROWS_MIN:
            left_out.append(f"{one.name} = {turned[0, 0]:g}")
        else:
            table.append((one, turned))
    order = {id(one): place for place, (one, _) in enumerate(table)}
    for one, turned in sorted(table, key=lambda pair: pair[0].clock is None):
        fitting = [group for group in groups if group.takes(len(turned), one.clock)]
        if one.clock is None:
            fitting = [group for group in groups if group.rows == len(turned)]
        if len(fitting) != 1:
            fitting = [_Group(len(turned), one.clock)]
            groups += fitting
        fitting[0].members.append((one, turned))
    for group in groups:
        group.members.sort(key=lambda pair: order[id(pair[0])])
    return groups, left_out


def _chosen(
    path: Path, tables: list[tuple[_Group, Table]], left_out: list[str], wanted: Wanted | None
) -> tuple[_Group, Table]:
    """Return the set of signals that is meant, with the columns that are wanted."""
    if not tables:
        there = f"; it holds {', '.join(left_out[:LISTED_MAX])}" if left_out else ""
        raise LogError(
            f"{path} holds no signals{there}. Give a file with at least one array of numbers that has "
            f"{ROWS_MIN} rows or more."
        )
    longest = max(group.rows for group, _ in tables)
    tables = [one for one in tables if one[0].clock or one[0].rows >= PARAMETER_SHARE * longest]
    fitting = tables
    if len(tables) > 1:
        fitting = []
        for one in tables:
            with suppress(LogError):
                one[1].only(wanted)
                fitting.append(one)
    if len(fitting) == 1:
        return fitting[0][0], fitting[0][1].only(wanted)
    listed = "; ".join([_listed(table) for _, table in tables])
    raise LogError(
        f"{path} holds {len(tables)} sets of signals, on different clocks or of different lengths: "
        f"{listed}. Choose one by the names of its columns, such as --columns output="
        f"{tables[0][0].members[0][0].name}; to use several, save each as a separate file and join "
        "them (`join` in the section [flight_log])."
    )


def _listed(table: Table) -> str:
    more = ", ..." if len(table.names) > LISTED_MAX else ""
    return f"{', '.join(table.names[:LISTED_MAX])}{more} ({len(table)} rows)"


def _table(path: Path, group: _Group) -> Table:
    """Return a set of signals column by column; its source is the form that they have."""
    one, turned = group.members[0]
    if len(group.members) == 1 and group.clock is None and turned.shape[1] > 1:
        return _of_matrix(path, one, turned)
    names, units, columns = [], [], []
    if group.clock is not None:
        names.append(group.clock.name)
        units.append(group.clock.unit)
        columns.append(group.clock.values)
    for one, turned in group.members:
        width = turned.shape[1]
        names += [one.name] if width == 1 else [f"{one.name}.{at}" for at in range(1, width + 1)]
        units += [one.unit] * width
        columns += list(turned.T)
    form = f"{len(group.members)} variable{'s' * (len(group.members) > 1)}"
    roles = dict(export_roles(names, units))
    if group.clock is not None:
        form += f" over the clock {group.clock.name}"
        roles["time"] = group.clock.name
    return Table(str(path), form, tuple(_unique(names)), tuple(units), tuple(columns), roles=roles)


def _of_matrix(path: Path, one: Variable, turned: Array) -> Table:
    """Return the columns of a matrix by number, the first as clock or index if it rises throughout."""
    names = [str(number) for number in range(1, turned.shape[1] + 1)]
    lying = "columns" if one.values.shape[0] == len(turned) else "rows"
    form = f"matrix {one.name}, {len(names)} signals in {lying}"
    roles = {}
    steps = np.diff(turned[:, 0])
    if np.all(steps == 1.0):
        roles["index"] = "1"
        form += ", the first counts the rows"
    elif np.all(steps > 0.0):
        roles["time"] = "1"
        form += ", the first is the clock"
    units = (one.unit,) * len(names)
    return Table(str(path), form, tuple(names), units, tuple(turned.T), roles=roles)


def _unique(names: Sequence[str]) -> list[str]:
    """Return the names, a later one that is there already with a number."""
    found: dict[str, None] = {}
    for name in names:
        number, free = 1, name
        while free in found:
            number += 1
            free = f"{name}.{number}"
        found[free] = None
    return list(found)
