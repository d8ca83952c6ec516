"""`tenbaud bench coders`: every coder against the floor."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from tenbaud.cli.checkout import need_checkout
from tenbaud.cli.figures import DATA_VARIABLE, found_data

bench = typer.Typer(no_args_is_help=True, help="Compare coders with the theoretical minimum.")


@bench.callback()
def _root() -> None:
    """Keep `coders` a command of its own, however few there are."""


@bench.command()
def coders(
    quick: Annotated[bool, typer.Option("--quick", help="Fewer seeds, wider intervals.")] = False,
    docs: Annotated[
        Path, typer.Option(help="Folder for LIMITS.md and, in figures/, its plots.")
    ] = Path("runs/bench-coders"),
    data: Annotated[
        Path | None, typer.Option(help="Folder of the recorded flights.", envvar=DATA_VARIABLE)
    ] = None,
) -> None:
    """Fly every coder on the same seeds, write the table and the pictures."""
    need_checkout("bench coders")
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

    from reproduction.limits.draw import draw_disturbances, draw_rates
    from reproduction.limits.page import DISTURBANCE_PICTURE, PICTURE, write_page
    from reproduction.limits.plan import FULL, QUICK, fly_all
    from reproduction.limits.recorded import fly_recorded
    from tenbaud.files.whole import make_folder

    found = found_data(data)
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
    )
    console = Console(stderr=True)
    with Progress(*columns, console=console, transient=True, disable=not sys.stderr.isatty()) as bar:
        task = bar.add_task("flights", total=1.0)
        outcome = fly_all(
            QUICK if quick else FULL, lambda done, total: bar.update(task, completed=done, total=total)
        )
        bar.update(task, description="recorded flights")
        recorded = fly_recorded(found) if found else []
    make_folder(docs / "figures")
    write_page(docs / "LIMITS.md", outcome, recorded, quick)
    draw_rates(docs / PICTURE, outcome)
    draw_disturbances(docs / DISTURBANCE_PICTURE, outcome)
    typer.echo(f"the table is in {docs / 'LIMITS.md'}")
    if found is None:
        typer.echo(
            f"the recorded flights were left out: give their folder with --data or in {DATA_VARIABLE}",
            err=True,
        )
