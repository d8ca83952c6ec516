"""`tenbaud sweep`: fly a study and plot it."""

from __future__ import annotations

import os
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tenbaud.cli import options
from tenbaud.cli.spread import spread
from tenbaud.cli.waiting import Waiting
from tenbaud.studies.progress import progress_bar

if TYPE_CHECKING:
    from tenbaud.studies.study import Study
    from tenbaud.studies.table import Results


@dataclass(frozen=True, slots=True)
class SweepOptions:
    """The study, and where it is flown."""

    study: Annotated[Path, typer.Argument()]
    """Study file (TOML); see docs/studies.md."""
    out: Path | None = None
    """Folder of the results; studies/<name> if not given. Resumes an existing study."""
    workers: Annotated[int | None, typer.Option(min=1, max=1024)] = None
    """Processes on this machine; default: all cores."""
    scheduler: str | None = None
    """Dask scheduler to fly on, such as tcp://HOST:8786."""
    seeds: Annotated[int | None, typer.Option(min=1, max=1_000_000)] = None
    """Seeds of each point, instead of the study's."""
    allow_code: options.AllowCode = False
    plots: bool = True
    """Draw the plots."""
    as_json: options.AsJson = False


@spread
def sweep(given: SweepOptions) -> None:
    """Fly a study: settings swept on a grid or sampled, many seeds, results as Parquet and plots.

    After a stop or a kill the same command continues with the missing flights.
    """
    from tenbaud.files.whole import remove
    from tenbaud.studies.settings import StudyError
    from tenbaud.studies.study import read_study
    from tenbaud.studies.table import Results

    if given.scheduler is not None and given.workers is not None:
        raise StudyError("--workers is of this machine and --scheduler of a cluster: give one of them")
    what = read_study(given.study, given.seeds, allow_code=given.allow_code)
    name = what.file.name
    folder = given.out or Path("studies") / name
    results = Results(what, folder)
    try:
        table = _fly(what, results, given.workers or os.cpu_count() or 1, given.scheduler)
    except KeyboardInterrupt:
        kept = folder.is_dir() and any(folder.iterdir())
        if kept:
            said = f"stopped; finished flights are kept in {folder}. The same command continues"
        else:
            said = "stopped before flights were finished"
            remove(folder)
        typer.echo(said, err=True)
        raise
    drawn = _draw(table, what, folder) if given.plots else []
    why = Counter(one for one in table["outcome"].to_pylist() if one != "ok")
    slow = Counter(one for one in table["not_compiled"].to_pylist() if one)
    summary = {
        "study": name,
        "points": len(what.points),
        "seeds": len(what.seeds),
        "flights": what.flights,
        "flights_without_figures": why.total(),
        "flights_compiled": sum(one == "compiled" for one in table["engine"].to_pylist()),
        "results": str(results.table_path),
        "plots": [str(path) for path in drawn],
    }
    if given.as_json:
        options.print_json(summary)
        return
    _tell(summary, why, slow)


def _fly(what: Study, results: Results, workers: int, scheduler: str | None) -> Any:
    from tenbaud.studies.run import run_study

    name = what.file.name
    with progress_bar(name, counted=True) as update:
        return run_study(
            what, results, lambda done, total: update(done, total, name), workers, scheduler
        )


def _draw(table: Any, what: Study, folder: Path) -> list[Path]:
    with Waiting("tenbaud sweep", doing="drawing"):
        from tenbaud.studies.plots import draw_study

        title = what.file.description or what.file.name
        return draw_study(table, what.names, title, folder, what.outputs)


def _tell(summary: dict[str, Any], why: Counter[str], slow: Counter[str]) -> None:
    """Print the summary; `why` flights have no figures or were not compiled, and how often."""
    seeds = "seed" if summary["seeds"] == 1 else "seeds"
    typer.echo(
        f"{summary['flights']} flights ({summary['points']} points, {summary['seeds']} {seeds} each), "
        f"{summary['flights_compiled']} of them compiled: {summary['results']}"
    )
    if slow:
        most, count = slow.most_common(1)[0]
        typer.echo(
            f"{slow.total()} were flown by the sessions, which is slower (column not_compiled). "
            f"{count} of them: {most}"
        )
    if why:
        most, count = why.most_common(1)[0]
        typer.echo(f"{why.total()} have no figures (column outcome). {count} of them: {most}")
    for path in summary["plots"]:
        typer.echo(f"  {path}")
