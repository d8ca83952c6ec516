"""The options to read a log: the given ones, the rest guessed from names or values."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from tenbaud.config.schema import FlightLogSection
from tenbaud.log.look import Look
from tenbaud.log.roles import Roles
from tenbaud.log.table import LogError, Table

MODEL = "identified"
MOTORS = ("front", "rear")
FIRST = ("pitch", "angle", "theta", "winkel")
"""Names of the output that is suggested where a log has several."""


@dataclass(frozen=True, slots=True)
class Suggestion:
    """The columns of the signals, and the options that say so."""

    taken: dict[str, str]
    """column of each signal"""
    section: FlightLogSection
    others: tuple[str, ...]
    """columns that may be outputs as well"""
    lacks_period: bool
    """neither file nor options say how far apart the rows are"""

    @property
    def options(self) -> str:
        section = self.section
        values = [
            ("--columns", _pairs(section.columns)),
            ("--units", _pairs(section.units)),
            ("--sign", _pairs(section.signs)),
            ("--scale", _pairs(section.scales)),
            ("--offset", _pairs(section.offsets)),
            ("--from", section.start_s),
            ("--to", section.end_s),
            ("--period", section.period_s),
        ]
        given = [(name, str(value)) for name, value in values if value not in ("", None)]
        words = [f"{name} {shlex.quote(value)}" for name, value in given]
        return " ".join(words + ["--remove-spikes"] * section.remove_spikes)

    def commands(self, beside: bool) -> list[str]:
        """Return the commands that use the log; `beside`: the options are in a file beside it."""
        file = shlex.quote(self.section.file)
        options = f" {self.options}" if self.options and not beside else ""
        options += " --period SECONDS" * self.lacks_period
        return [
            f"tenbaud identify {file}{options} --out {MODEL}",
            f"tenbaud demo --link memory --config {MODEL}/identified.toml --rig replay:{file}{options}",
        ]


def suggest(section: FlightLogSection, table: Table, looks: Sequence[Look]) -> Suggestion:
    """Return a column for every signal, and a unit where only the values tell it."""
    try:
        taken, others = _by_names(section, table)
    except LogError:
        taken, others = _by_looks(table, looks)
        if section.period_s is not None:
            taken.pop("time", None)
    given = {
        role: table.names[table.find(name)] for role, name in section.columns.items() if name != "0"
    }
    taken = {role: name for role, name in taken.items() if name not in given.values()} | given
    if any(role.startswith("out:") for role in table.roles):
        return Suggestion(taken, section, others, False)  # the tool's own file says it all
    units = {}
    for role, name in taken.items():
        look = next(one for one in looks if one.name == name)
        is_output = role.partition(":")[0] not in (*MOTORS, "in", "input", "index", "time")
        if look.guess and (is_output or (role == "time" and look.unit != "s")):
            units[role] = look.unit
    changed = {"columns": taken | section.columns, "units": units | section.units}
    lacks_period = "time" not in taken and section.period_s is None and table.period_s is None
    return Suggestion(taken, section.model_copy(update=changed), others, lacks_period)


def _pairs(values: dict[str, Any]) -> str:
    return ",".join(f"{name}={value}" for name, value in values.items())


def _by_names(section: FlightLogSection, table: Table) -> tuple[dict[str, str], tuple[str, ...]]:
    chosen = Roles(section.file, section, None).choose(table.names, table.units, table.roles)
    name = table.names.__getitem__
    first = [one for one in chosen.outputs if one[0].name in FIRST]
    columns = [name(place) for _, place in dict.fromkeys([*first, *chosen.outputs])]
    inputs = [name(place) for _, place in chosen.inputs if place is not None]
    clock = {"index": chosen.index, "time": chosen.time}
    found = {role: name(place) for role, place in clock.items() if place is not None}
    return _signals(columns[:1], inputs) | found, tuple(columns[1:])


def _by_looks(table: Table, looks: Sequence[Look]) -> tuple[dict[str, str], tuple[str, ...]]:
    """Return a clock, the first column that moves, and switching or constant columns as inputs."""
    clock: dict[str, str] = {}
    for role in ("time", "index"):
        kind = "clock" if role == "time" else role
        name = table.roles.get(role) or next((one.name for one in looks if one.kind == kind), "")
        if name and not clock:
            clock[role] = name
    rest = [one for one in looks if one.name not in clock.values()]
    moving = [one.name for one in rest if one.moves]
    inputs = [one.name for one in rest if one.kind in ("command", "constant")]
    if not inputs:
        moving, inputs = moving[:1], moving[1:]
    return _signals(moving[:1], inputs[: len(MOTORS)]) | clock, tuple(moving[1:])


def _signals(outputs: Sequence[str], inputs: Sequence[str]) -> dict[str, str]:
    if len(inputs) > len(MOTORS):
        names: Sequence[str] = [f"in:{number}" for number in range(1, len(inputs) + 1)]
    else:
        names = MOTORS if len(inputs) > 1 else ("input",)
    return dict(zip(("angle",), outputs, strict=False)) | dict(zip(names, inputs, strict=False))
