"""Old names in configurations: they are still read, with a warning that gives the new name."""

from __future__ import annotations

import copy
from typing import Any

from tenbaud.config.warned import warn as warn_of

RENAMED: dict[str, dict[str, str]] = {
    "preset": {"timed-10baud": "open-loop-zoom-10baud"},
    "coder.kind": {"timed": "open-loop-zoom", "words": "pcm"},
}
"""Old name to new, of the values of a setting."""
MOVED = {
    "limits.volts_max": "limits.command_max",
    "limits.slew_volts_per_s": "limits.command_slew_per_s",
    "limits.initial_volts": "limits.initial_command",
    "transmitter.safe_volts": "transmitter.safe_command",
    "transmitter.soft_limit_rad": "transmitter.soft_limits",
    "transmitter.encoder_counts_per_turn": "transmitter.encoders.counts_per_turn",
    "transmitter.encoder_sign": "transmitter.encoders.sign",
    "transmitter.encoder_zero_counts": "transmitter.encoders.zero_counts",
    "transmitter.sight_bandwidth_rad_s": "transmitter.rate_observer_bandwidth_rad_s",
    "transmitter.plant.initial_angle_rad": "transmitter.plant.initial",
    "receiver.reference.amplitude_rad": "receiver.reference.amplitude",
}
"""Old full name of a field to the new one."""
LOG_COLUMNS = {
    "time": "time",
    "index": "index",
    "index_column": "index",
    "counts_column": "out:1",
    "outputs": "out:",
    "inputs": "in:",
    "volts_columns": "in:",
}
"""Old name to new in `columns` of a recorded flight; behind a colon follow the names of signals."""
DIGEST_KINDS = {new: old for old, new in RENAMED["coder.kind"].items()}
"""Names in the shared configuration, whose digest both ends compare and recordings hold."""


def current_name(place: str, name: str, source: str, *, warn: bool = True) -> str:
    """Return the present name of a value; warn, if asked to, where `name` is an old one."""
    new = RENAMED[place].get(name, name)
    if warn and new != name:
        warn_of(f"{source}: {place}: {name!r} is deprecated; use {new!r}", FutureWarning)
    return new


def with_current_names(values: dict[str, Any], source: str, *, warn: bool = True) -> dict[str, Any]:
    """Return the values of a configuration under their present names."""
    values = copy.deepcopy(values)
    _name_log_columns(values.get("flight_log"), source, warn=warn)
    coder = values.get("coder")
    if isinstance(coder, dict) and isinstance(coder.get("kind"), str):
        coder["kind"] = current_name("coder.kind", coder["kind"], source, warn=warn)
    for old, new in MOVED.items():
        *sections, field = old.split(".")
        here: Any = values
        for section in sections:
            here = here.get(section) if isinstance(here, dict) else None
        if not isinstance(here, dict) or field not in here:
            continue
        if warn:
            warn_of(f"{source}: {old!r} is deprecated; use {new!r}", FutureWarning)
        *sections, name = new.split(".")
        there: Any = values
        for section in sections:
            there = there.setdefault(section, {}) if isinstance(there, dict) else None
        # Where a section is no table, the schema refuses both by name.
        if isinstance(there, dict):
            there.setdefault(name, here.pop(field))
    return values


def _name_log_columns(section: Any, source: str, *, warn: bool) -> None:
    """Give the columns of a recorded flight, which had fields of their own, to their signals."""
    if not isinstance(section, dict):
        return
    columns = section.get("columns", {})
    if not isinstance(columns, dict):
        return
    for old, new in LOG_COLUMNS.items():
        value: Any = section.get(old)
        # What is of another type stays where it is: the schema refuses it by name.
        if value and not isinstance(value, (dict, list, tuple) if new[-1] == ":" else str):
            continue
        section.pop(old, None)
        if not value:
            continue
        if warn:
            text = f"{source}: 'flight_log.{old}' is deprecated; use 'flight_log.columns'"
            warn_of(text, FutureWarning)
        if isinstance(value, (list, tuple)):
            value = {str(at): name for at, name in enumerate(value, 1)}
        named = {f"{new}{name}": one for name, one in value.items()} if new[-1] == ":" else {new: value}
        section["columns"] = columns = {**named, **columns}
