"""Commands that make the project's own pages: their code is in `reproduction`, which a checkout has."""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec

import typer

from tenbaud.cli.flags import Command, Group

PANEL = "Models, coders, studies"


def add_commands(app: typer.Typer) -> None:
    """Add `figures` and `bench coders`; without a checkout, commands that report the need for one."""
    bench = typer.Typer(
        cls=Group, no_args_is_help=True, help="Compare coders with the theoretical minimum."
    )
    # Keeps `coders` a subcommand although it is the only one.
    bench.callback()(lambda: None)
    app.add_typer(bench, name="bench", rich_help_panel=PANEL)
    if find_spec("reproduction") is not None:
        from reproduction.commands import coders, figures

        app.command(cls=Command, rich_help_panel=PANEL)(figures)
        bench.command(cls=Command)(coders)
        return
    anything = {"allow_extra_args": True, "ignore_unknown_options": True}
    app.command("figures", rich_help_panel=PANEL, context_settings=anything)(_needs_checkout("figures"))
    bench.command("coders", context_settings=anything)(_needs_checkout("bench coders"))


def _needs_checkout(command: str) -> Callable[[], None]:
    def refuse() -> None:
        """Make pages of the project's own documentation; needs a checkout of the repository."""
        from tenbaud.config.load import ConfigError

        raise ConfigError(
            f"`tenbaud {command}` makes pages of the project's own documentation and works in a "
            "checkout of it only: clone the repository, run `pip install --editable .` in it, and "
            "call the command from there"
        )

    return refuse
