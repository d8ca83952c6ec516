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
    """Name the first sample at which two recordings differ, and the field.

    Exit code 0: equal. 1: a value differs. 2: not comparable, because rows are missing that both should
    hold, or because there is nothing to compare; what is missing is named.

    [dim]tenbaud diff runs/monday runs/tuesday[/dim]
    """
    from tenbaud.recording.comparison import Verdict
    from tenbaud.recording.diff import compare_runs, files_to_compare

    compared = compare_runs(run_a, run_b)
    if compared.verdict is Verdict.EQUAL:
        pairs = (f"{pair.first} and {pair.second}" for pair in files_to_compare(run_a, run_b))
        typer.echo(f"no difference between {', '.join(pairs)}")
    if text := str(compared):
        typer.echo(text)
    if compared.verdict is Verdict.DIFFERENT:
        raise typer.Exit(int(ExitCode.FAILED))
    if compared.verdict is Verdict.NOT_COMPARABLE:
        raise typer.Exit(int(ExitCode.USAGE))


def presets() -> None:
    """List the presets that come with tenbaud."""
    from tenbaud.config.load import load_config, preset_names

    names = preset_names()
    width = max(map(len, names))
    for name in names:
        typer.echo(f"{name:{width}}  {load_config(name).description}")
