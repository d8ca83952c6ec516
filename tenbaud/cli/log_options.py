"""The options that describe a recorded log, of every command that reads one."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Annotated, Any

import typer


@dataclass(frozen=True, slots=True)
class LogOptions:
    """Columns, units and the interval of a log."""

    columns: str = ""
    """Columns of the log, by name or number: angle=NAME,front=NAME,time=NAME. Names are the model's
    signals, angle (its first output), input, time and index; 0: no such input."""
    units: Annotated[str, typer.Option("--units", "--unit")] = ""
    """Units in the log: pitch=deg,time=ms; one word: of all angles."""
    sign: str = ""
    """Signs of columns: pitch=-1."""
    scale: str = ""
    """Factors of columns: front=0.01."""
    offset: str = ""
    """Offsets added to columns then: pitch=-0.2."""
    start: Annotated[float | None, typer.Option("--from", min=-2.4e9, max=2.4e9)] = None
    """Start within the log, on its own clock, s."""
    end: Annotated[float | None, typer.Option("--to", min=-2.4e9, max=2.4e9)] = None
    """End within the log, on its own clock, s."""
    period: Annotated[float | None, typer.Option(min=1e-6, max=1e6)] = None
    """Time between rows of a log without a clock, s."""
    remove_spikes: bool = False
    """Replace single outlier rows by the mean of their neighbours."""

    def settings(self) -> dict[str, Any]:
        """Return the fields of the configuration that the options set, by their full names."""
        values: dict[str, Any] = {
            "columns": pairs("--columns", self.columns),
            "units": pairs("--units", self.units, "angles"),
            "signs": _numbers("--sign", self.sign, int),
            "scales": _numbers("--scale", self.scale, float),
            "offsets": _numbers("--offset", self.offset, float),
            "start_s": self.start,
            "end_s": self.end,
            "period_s": self.period,
            "remove_spikes": self.remove_spikes,
        }
        return {
            f"flight_log.{name}": value
            for name, value in values.items()
            if value not in (None, {}, False)
        }


def pairs(option: str, text: str, single: str = "") -> dict[str, str]:
    """Return NAME=VALUE pieces; a value may hold commas. `single` is the name of a value alone."""
    found: dict[str, str] = {}
    for piece in filter(None, re.split(r",(?=\s*[\w:]+\s*=)", text)):
        name, equals, value = piece.partition("=")
        if not equals and single:
            name, value = single, piece
        elif not equals or not value.strip():
            raise typer.BadParameter(f"{option}: '{piece}' is not NAME=VALUE, such as angle=pitch_deg")
        found[name.strip()] = value.strip().strip('"')
    return found


def _numbers(option: str, text: str, kind: type[int] | type[float]) -> dict[str, float]:
    try:
        return {name: kind(value) for name, value in pairs(option, text, "angles").items()}
    except ValueError as error:
        raise typer.BadParameter(f"{option}: {error}; write NAME=NUMBER") from error
