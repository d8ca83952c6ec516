"""All commands. Each is in a separate module beside this one."""

from __future__ import annotations

from copy import copy
from typing import Annotated

import typer

from tenbaud.cli import (
    demo,
    design,
    export,
    identify,
    keys,
    log,
    nodes,
    rig,
    router,
    runs,
    sweep,
    tune,
    view,
)
from tenbaud.cli.checkout import add_commands
from tenbaud.cli.flags import Command, Group

app = typer.Typer(
    cls=Group,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    help="""Fly a helicopter over a ten-baud wire.

    Both ends on this machine:   [bold]tenbaud demo[/bold]

    One end per terminal:        [bold]tenbaud receive[/bold]   and   [bold]tenbaud transmit[/bold]
    """,
)


def _show_version(wanted: bool) -> None:
    if wanted:
        from tenbaud.config.version import software_version

        typer.echo(f"tenbaud {software_version()}")
        raise typer.Exit


@app.callback()
def _root(
    version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Show version.")
    ] = False,
) -> None:
    """Take the options that come before the command."""


for panel, commands in (
    ("Fly", (demo.demo, nodes.transmit, nodes.receive, view.view, runs.presets)),
    (
        "What was flown",
        (
            runs.inspect,
            runs.compare,
            runs.diff,
            runs.replay,
            runs.audit,
            runs.convert,
            runs.recover,
        ),
    ),
    ("Rigs and machines", (rig.doctor, rig.rig, rig.rig_check, router.router)),
    (
        "Models, coders, studies",
        (
            design.floor,
            design.design,
            log.log,
            identify.identify,
            sweep.sweep,
            tune.tune,
            export.export_c,
        ),
    ),
):
    for command in commands:
        name = command.__name__.replace("_", "-")
        app.command(name, cls=Command, rich_help_panel=panel)(command)
app.add_typer(keys.app, name="keys", rich_help_panel="Rigs and machines")
add_commands(app)


def app_for(arguments: list[str]) -> typer.Typer:
    """Return the app with only the requested command: the others take time to build.

    If the first argument is not a command, return the whole app.
    """
    commands = [one for one in app.registered_commands if [one.name] == arguments[:1]]
    if not commands:
        return app
    small = copy(app)
    small.registered_commands, small.registered_groups = commands, []
    return small
