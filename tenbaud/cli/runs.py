"""Commands about runs already flown, and about presets."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tenbaud.flight.outcome import ExitCode


def inspect(
    run: Annotated[Path, typer.Argument(help="Folder of a run, or one recording.")],
    json: Annotated[bool, typer.Option("--json", help="The same as JSON.")] = False,
) -> None:
    """Show what a run's recordings hold: channels, units, spans, events.

    [dim]tenbaud inspect runs/2026-11-23T10-00-00_paper-10baud[/dim]
    """
    from tenbaud.recording.inspect import describe_json, describe_text

    if json:
        import json as json_module

        typer.echo(json_module.dumps(describe_json(run), indent=2))
        return
    typer.echo(describe_text(run))


def diff(
    run_a: Annotated[Path, typer.Argument(help="Folder of a run, or one recording.")],
    run_b: Annotated[
        Path | None,
        typer.Argument(help="Another; not given: the two ends of the first are compared."),
    ] = None,
) -> None:
    """Name the first sample at which two recordings differ, and the field. Exit code 1 if they do.

    [dim]tenbaud diff runs/monday runs/tuesday[/dim]
    """
    from tenbaud.recording.diff import files_to_compare, first_difference

    difference = first_difference(run_a, run_b)
    if difference is not None:
        typer.echo(str(difference))
        raise typer.Exit(int(ExitCode.FAILED))
    compared = ", ".join(f"{pair.first} and {pair.second}" for pair in files_to_compare(run_a, run_b))
    typer.echo(f"no difference between {compared}")


def presets() -> None:
    """List the presets that come with tenbaud."""
    from tenbaud.config.load import load_config, preset_names

    names = preset_names()
    width = max(map(len, names))
    for name in names:
        typer.echo(f"{name:{width}}  {load_config(name).description}")
