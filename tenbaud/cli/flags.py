"""Commands whose help has no type beside a flag, and no table on a narrow terminal."""

from __future__ import annotations

import shutil
from functools import partial
from typing import Any

from typer.core import TyperCommand, TyperGroup

TABLE_WIDTH = 72
"""The table of options folds words on a terminal that is narrower."""


class Command(TyperCommand):
    """A command."""

    def get_params(self, ctx: Any) -> list[Any]:
        return _plain(super().get_params(ctx))

    def format_help(self, ctx: Any, formatter: Any) -> None:
        _without_table(self, formatter)
        super().format_help(ctx, formatter)


class Group(TyperGroup):
    """A command with commands below it."""

    def get_params(self, ctx: Any) -> list[Any]:
        return _plain(super().get_params(ctx))

    def format_help(self, ctx: Any, formatter: Any) -> None:
        _without_table(self, formatter)
        super().format_help(ctx, formatter)


def _without_table(command: Command | Group, formatter: Any) -> None:
    """Have a narrow terminal get the help as plain lines."""
    columns = shutil.get_terminal_size().columns
    if columns >= TABLE_WIDTH:
        return
    from rich.text import Text

    formatter.width = columns - 1
    # A longer name of an option has its text below it, not in a column that is left.
    formatter.write_dl = partial(formatter.write_dl, col_max=columns // 3)
    command.rich_markup_mode = None
    command.help = Text.from_markup(command.help or "").plain


def _plain(parameters: list[Any]) -> list[Any]:
    for one in parameters:
        if getattr(one, "is_flag", False):
            one.metavar = ""
    return parameters
