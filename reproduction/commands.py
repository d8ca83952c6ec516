"""`tenbaud figures` and `tenbaud bench coders`: the commands that make the project's own pages."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tenbaud.studies.progress import progress_bar

DRAWINGS = ("theory", "animation", "axes", "cliff", "bothways")
DATA_VARIABLE = "TENBAUD_FLIGHT_DATA"

Out = Annotated[
    Path | None, typer.Option(help="New folder for the run; runs/<time>_<name> if not given.")
]


def figures(
    which: Annotated[
        list[str] | None,
        typer.Argument(
            help="3, 4, 5, 6, 7, 8 or all; several may be given. For the pages: theory, animation, "
            "axes, cliff, bothways."
        ),
    ] = None,
    docs: Annotated[
        Path | None,
        typer.Option(
            help="Folder for REPRODUCTION.md and, in figures/, its plots, such as docs; not given: "
            "the run's folder.",
            show_default=False,
        ),
    ] = None,
    data: Annotated[
        Path | None,
        typer.Option(
            envvar=DATA_VARIABLE,
            help="Folder with the recorded flights (uiuc_closed_loop.csv and others).",
            show_default=False,
        ),
    ] = None,
    quick: Annotated[
        bool,
        typer.Option("--quick", help="cliff, bothways: few and short flights, to see that it works."),
    ] = False,
    out: Out = None,
) -> None:
    """Fly and draw the paper's Figs. 3 to 8; with all of them, write the page that compares them.

    cliff: flights near the smallest rate of a pendulum and a rotary pendulum. bothways: narrow
    downlinks of all rates on lines of all kinds. Both fly only what is missing in the folder.

    [dim]tenbaud figures 7[/dim]

    [dim]tenbaud figures all --docs docs --data FOLDER[/dim]

    [dim]tenbaud figures theory animation cliff --docs docs[/dim]
    """
    from reproduction.paper.make import NUMBERS
    from tenbaud.files.whole import make_folder
    from tenbaud.recording.folder import create_run_folder

    drawings = [name for name in which or () if name in DRAWINGS]
    wanted = _wanted([name for name in which or ["all"] if name not in drawings], NUMBERS)
    found = found_data(data)
    # A run's folder is for flights; the pages' drawings leave none.
    folder = create_run_folder(None, "figures", out) if wanted or docs is None else docs
    pictures = (docs or folder) / "figures"
    make_folder(pictures)
    if drawings:
        _draw_documentation(drawings, pictures)
    if "cliff" in drawings:
        _draw_cliff(docs or folder, pictures, quick)
    if "bothways" in drawings:
        _draw_bothways(docs or folder, pictures, quick)
    if wanted:
        _draw_paper(wanted, folder, pictures, found)


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
    from reproduction.limits.draw import draw_disturbances, draw_rates
    from reproduction.limits.page import DISTURBANCE_PICTURE, PICTURE, write_page
    from reproduction.limits.plan import FULL, QUICK, fly_all
    from reproduction.limits.recorded import fly_recorded
    from tenbaud.files.whole import make_folder

    found = found_data(data)
    with progress_bar("flights") as update:
        outcome = fly_all(QUICK if quick else FULL, lambda done, total: update(done, total, "flights"))
        update(1.0, 1.0, "recorded flights")
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


def _draw_paper(wanted: set[str], folder: Path, pictures: Path, data: Path | None) -> None:
    """Draw figures of the paper and, with all of them, write the page beside their folder."""
    from reproduction.paper.make import NUMBERS, make_figures

    with progress_bar("starting") as update:
        results = make_figures(wanted, folder, pictures, data, update)
    typer.echo(f"{len(results.flown)} flights in {results.seconds:.0f} s; pictures in {pictures}")
    typer.echo(f"SVG and recordings in {folder}")
    if wanted != set(NUMBERS):
        return
    from reproduction.paper.page import write_page

    page = pictures.parent / "REPRODUCTION.md"
    write_page(page, results)
    typer.echo(f"the table is in {page}")
    if data is None:
        typer.echo(
            f"the recorded flights were left out: give their folder with --data or in {DATA_VARIABLE}",
            err=True,
        )


def _draw_documentation(drawings: list[str], pictures: Path) -> None:
    """Draw what belongs to no figure of the paper."""
    from reproduction.paper.animation import draw_animation
    from reproduction.paper.theory import draw_theory

    if "theory" in drawings:
        for path in draw_theory(pictures, lambda name: typer.echo(f"drawing {name}", err=True)):
            typer.echo(str(path))
    if "axes" in drawings:
        from reproduction.axes.page import FULL, make_page

        with progress_bar("flights") as update:
            page = make_page(pictures.parent, FULL, lambda share, part: update(share, 1.0, part))
        typer.echo(f"the tables are in {page}")
    if "animation" in drawings:
        path = pictures / "tenbaud.gif"
        typer.echo(f"{path}, {draw_animation(path) / 1e6:.2f} MB")


def _draw_cliff(docs: Path, pictures: Path, quick: bool) -> None:
    """Fly near the smallest rates; draw it, and write the tables."""
    from reproduction.cliff import FULL, QUICK, claims, fly_all
    from reproduction.cliff_page import draw, write_page
    from tenbaud.files.whole import make_folder

    swept, claimed = (QUICK, []) if quick else (FULL, claims())
    with progress_bar("flights") as update:
        found = fly_all([*claimed, *swept], pictures / "cliff.json", update)
    draw([pictures / "cliff.png", pictures / "cliff.svg"], {one: found[one] for one in swept})
    make_folder(docs / "theory")
    page = docs / "theory" / "cliff.md"
    write_page(page, {one: found[one] for one in swept}, {one: found[one] for one in claimed})
    typer.echo(f"the tables are in {page}, the points in {pictures / 'cliff.json'}")


def _draw_bothways(docs: Path, pictures: Path, quick: bool) -> None:
    """Fly with narrow downlinks; draw them, and write the page."""
    from reproduction.bothways.draw import draw
    from reproduction.bothways.page import write_page
    from reproduction.bothways.study import aims, fly_all, grid

    points = grid(quick)
    more = [] if quick else list(aims().values())
    with progress_bar("flights") as update:
        found = fly_all([*more, *points], pictures / "bothways.json", update)
    draw(docs, found)
    page = docs / "BOTHWAYS.md"
    write_page(page, found, quick)
    typer.echo(f"the tables are in {page}, the points in {pictures / 'bothways.json'}")


def _wanted(names: list[str], known: tuple[str, ...]) -> set[str]:
    for name in names:
        if name not in (*known, "all"):
            raise typer.BadParameter(
                f"'{name}': known are {', '.join(known)} and all; {', '.join(DRAWINGS)}"
            )
    return set(known) if "all" in names else set(names)


def found_data(given: Path | None) -> Path | None:
    """Return the folder of the recorded flights; ConfigError when it was named and holds none."""
    from reproduction.paper.real import UIUC_FILE
    from tenbaud.config.load import ConfigError

    if given is None:
        beside = Path("..") / "shared" / "data"
        return beside if (beside / UIUC_FILE).is_file() else None
    if not (given / UIUC_FILE).is_file():
        raise ConfigError(f"{given} holds no {UIUC_FILE}; give the folder of the recorded flights")
    return given
