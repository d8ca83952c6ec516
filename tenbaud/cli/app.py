"""The commands, gathered. Each lives in a module of its own beside this one."""

from __future__ import annotations

import sys
from typing import Annotated

import typer

from tenbaud.cli import (
    bench,
    demo,
    doctor,
    figures,
    files,
    identify,
    keys,
    nodes,
    replays,
    rig,
    router,
    runs,
    sweep,
    tune,
    view,
)
from tenbaud.flight.outcome import ExitCode, outcome_of

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    help="""Fly a helicopter over a ten-baud wire.

    Both ends on this machine:   [bold]tenbaud demo[/bold]

    One end per terminal:        [bold]tenbaud receive[/bold]   and   [bold]tenbaud transmit[/bold]
    """,
)


def _show_version(wanted: bool) -> None:
    if wanted:
        from tenbaud.build import software_version

        typer.echo(f"tenbaud {software_version()}")
        raise typer.Exit


@app.callback()
def _root(
    version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Show version.")
    ] = False,
) -> None:
    """Take the options that come before the command."""


app.command()(demo.demo)
app.command()(nodes.transmit)
app.command()(nodes.receive)
app.command()(view.view)
app.command()(router.router)
app.add_typer(keys.app, name="keys")
app.command()(identify.identify)
app.command()(figures.figures)
app.command()(sweep.sweep)
app.command()(tune.tune)
app.command()(runs.inspect)
app.command()(runs.diff)
app.command()(replays.replay)
app.command()(replays.audit)
app.command()(files.convert)
app.command()(files.recover)
app.command()(runs.presets)
app.command()(doctor.doctor)
app.add_typer(bench.bench, name="bench")
app.command()(rig.rig)
app.command()(rig.rig_check)


def main() -> None:
    """Run the command line; errors become one message and an exit code."""
    from channel.errors import TenbaudError

    try:
        app()
    except (TenbaudError, ValueError) as error:
        typer.echo(f"tenbaud: {error}", err=True)
        code = outcome_of(error).code
        sys.exit(ExitCode.USAGE if code is ExitCode.FAILED else code)
    except KeyboardInterrupt:
        sys.exit(ExitCode.INTERRUPTED)
