"""Commands that turn recordings into files for other tools."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

RunArgument = Annotated[Path, typer.Argument(help="Folder of a run, or one recording.")]


class Form(StrEnum):
    """The formats that a run converts to."""

    CSV = "csv"
    MAT = "mat"
    PARQUET = "parquet"
    JSON = "json"
    MCAP = "mcap"


def convert(
    run: RunArgument,
    to: Annotated[
        Form, typer.Option(help="mcap: one file for Foxglove and PlotJuggler, with layouts.")
    ],
    out: Annotated[
        Path | None,
        typer.Option(help="File, or folder for csv and parquet; into the run's folder if not given."),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace existing files.")] = False,
) -> None:
    """Write a run for other tools, with units: all signals on one time base, samples, events.

    [dim]tenbaud convert runs/2026-11-23T10-00-00_paper-10baud --to csv[/dim]

    [dim]tenbaud convert runs/2026-11-23T10-00-00_paper-10baud --to mat --out flight.mat[/dim]
    """
    from tenbaud.recording.convert import convert as convert_run
    from tenbaud.recording.run import Run

    opened = Run(run)
    for note in opened.notes:
        typer.echo(f"note: {note}", err=True)
    for path in convert_run(opened, to.value, out, overwrite=force):
        typer.echo(str(path))


def recover(
    run: RunArgument,
    out: Annotated[
        Path | None,
        typer.Option(help="Path of the repaired file; the damaged file then stays in place."),
    ] = None,
) -> None:
    """Repair recordings that were truncated or damaged; the damaged files are kept.

    [dim]tenbaud recover runs/2026-11-23T10-00-00_paper-10baud[/dim]
    """
    from tenbaud.recording.recover import recover as recover_run

    for recovered in recover_run(run, out):
        typer.echo(str(recovered))
