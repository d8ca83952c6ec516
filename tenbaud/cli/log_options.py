"""The options that describe a recorded log, of every command that reads one."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Annotated, Any

import typer

CLOCK: Any = {"min": -2.4e9, "max": 2.4e9, "show_default": False}


def _text(help: str, *names: str) -> Any:
    return typer.Option(*names, help=help, show_default=False)


@dataclass(frozen=True, slots=True)
class LogOptions:
    """Columns, units and the interval of a log."""

    columns: Annotated[
        str,
        _text(
            "Columns of the log, by name or number: angle=NAME,front=NAME,time=NAME. Names are the "
            "model's signals, angle (its first output), input, time and index; 0: no such input."
        ),
    ] = ""
    units: Annotated[
        str,
        _text("Units in the log: pitch=deg,time=ms; one word: of all angles.", "--units", "--unit"),
    ] = ""
    sign: Annotated[str, _text("Signs of columns: pitch=-1.")] = ""
    scale: Annotated[str, _text("Factors of columns: front=0.01.")] = ""
    offset: Annotated[str, _text("Offsets added to columns then: pitch=-0.2.")] = ""
    start: Annotated[
        float | None,
        typer.Option("--from", help="Start within the log, on its own clock, s.", **CLOCK),
    ] = None
    end: Annotated[
        float | None, typer.Option("--to", help="End within the log, on its own clock, s.", **CLOCK)
    ] = None
    period: Annotated[
        float | None,
        typer.Option(help="Time between rows of a log without a clock, s.", min=1e-6, max=1e6),
    ] = None
    remove_spikes: Annotated[
        bool,
        typer.Option(
            "--remove-spikes", help="Replace single outlier rows by the mean of their neighbours."
        ),
    ] = False

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
