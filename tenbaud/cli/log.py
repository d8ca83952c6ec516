"""`tenbaud log`: the content of a recorded log, and the options to read it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tenbaud.cli import options
from tenbaud.cli.log_options import LogOptions
from tenbaud.cli.spread import spread


@spread
def log(
    given: LogOptions,
    file: Annotated[
        Path,
        typer.Argument(
            help="CSV or text, MATLAB, Parquet, NumPy, TDMS or MCAP file; a run's folder or exports."
        ),
    ],
    plot: Annotated[
        Path | None, typer.Option(help="Draw the columns into this file (.png, .svg, .pdf).")
    ] = None,
    write: Annotated[
        bool, typer.Option("--write", help="Store the options in FILE.toml, which other commands read.")
    ] = False,
    json: options.AsJson = False,
) -> None:
    """Show a log's columns, units, sampling and faults, and the commands that use it.

    Exit code 0: the log can be used with the options shown. 1: it has errors, which are listed.

    [dim]tenbaud log flight.csv --plot flight.png[/dim]

    [dim]tenbaud log run.mat --columns time=1,angle=2,input=3 --units angle=deg --write[/dim]
    """
    from tenbaud.config.load import checked, nested
    from tenbaud.flight.outcome import ExitCode
    from tenbaud.log.describe import describe

    config = checked(nested({"flight_log.file": str(file), **given.settings()}), file)
    described, table = describe(config.flight_log)
    if plot is not None:
        from tenbaud.log.figure import draw_log

        draw_log(described, table, plot)
    write = write and not described.problem
    if write:
        from tenbaud.log.beside import write_beside

        write_beside(described.suggestion.section)
    if json:
        options.print_json(described.as_json())
    else:
        typer.echo(f"{file}: {described.as_text(beside=write)}")
    if described.problem:
        raise typer.Exit(int(ExitCode.FAILED))
