"""`tenbaud tune`: fit a coder's constants on some flights and judge them on others."""

from __future__ import annotations

import json
import math
import re
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tenbaud.cli import options

if TYPE_CHECKING:
    from tenbaud.studies.tuning import Tuned


class MethodOption(StrEnum):
    """How to search."""

    EVOLUTION = "differential-evolution"
    SIMPLEX = "nelder-mead"


def tune(
    out: Annotated[Path, typer.Option(help="File for the preset that was found; must not exist yet.")],
    preset: options.Preset = None,
    config: options.ConfigFile = None,
    rig: options.Rig = None,
    duration: options.Duration = None,
    mismatch: Annotated[float | None, typer.Option(help="Plant off the model, 0.1 for 10 %.")] = None,
    disturbance: options.Disturbance = None,
    impair: options.Impair = None,
    settings: options.Settings = None,
    free: Annotated[
        list[str] | None,
        typer.Option(
            help="Constant to fit and its range, such as coder.decay=0.7..0.99 or "
            "coder.minimum_range_rad=0.003..0.1:log; repeatable. Not given: the usual ones."
        ),
    ] = None,
    model: Annotated[bool, typer.Option("--model", help="Fit the model's constants as well.")] = False,
    seeds: Annotated[int, typer.Option(min=1, help="Simulated flights for the fit.")] = 6,
    test_seeds: Annotated[int, typer.Option(min=1, help="Other flights for the judgement.")] = 12,
    train_share: Annotated[
        float, typer.Option(min=0.05, max=0.95, help="Share of a recorded flight for the fit.")
    ] = 0.5,
    method: Annotated[MethodOption, typer.Option(help="How to search.")] = MethodOption.EVOLUTION,
    evaluations: Annotated[int, typer.Option(min=1, help="How often to fly at most.")] = 600,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the search.")] = 1,
    as_json: options.AsJson = False,
) -> None:
    """Fit a coder's constants, and with --model the model's, on flights; judge them on others."""
    from tenbaud.studies.compiled import require
    from tenbaud.studies.settings import StudyError

    require("numba")
    from tenbaud.studies.tuning import Split, Tuning, free_ranges, preset_text
    from tenbaud.studies.tuning import tune as fit

    if out.exists():
        raise StudyError(f"{out} exists already; name another file")
    overrides = options.overrides(
        duration=duration,
        rig=rig,
        mismatch=mismatch,
        disturbance=disturbance,
        impair=impair,
        settings=settings,
    )
    first = seeds + 1
    split = Split(tuple(range(1, first)), tuple(range(first, first + test_seeds)), train_share)
    named = dict(_parse_free(text) for text in free or ())
    tuning = Tuning(preset, config, overrides, {}, split, method.value, evaluations, seed)
    ranges = free_ranges(tuning.config({}), named, model=model)
    tuning = Tuning(preset, config, overrides, ranges, split, method.value, evaluations, seed)
    with _bar(evaluations) as (progress, task):

        def told(count: int, error: float) -> None:
            text = f"best {math.degrees(error):.4g}°"
            progress.update(task, completed=min(count, evaluations), description=text)

        tuned = fit(tuning, told)
    out.parent.mkdir(parents=True, exist_ok=True)
    out.write_text(preset_text(tuning, tuned), encoding="utf-8")
    if as_json:
        typer.echo(json.dumps({**tuned._asdict(), "preset_file": str(out)}, indent=2))
        return
    _tell(tuned)
    typer.echo(f"{out}: fly it with --config {out}")


def _tell(tuned: Tuned) -> None:
    """Print constants and errors."""
    for name, value in tuned.values.items():
        typer.echo(f"{name:36} {value:.6g}")
    for what, before, after in (
        (f"fit on {tuned.train_what}", tuned.train_before, tuned.train_after),
        (f"judged on {tuned.test_what}", tuned.test_before, tuned.test_after),
    ):
        before_deg, after_deg = math.degrees(before), math.degrees(after)
        typer.echo(f"{what}: rms error {before_deg:.4g} -> {after_deg:.4g} degrees")
    if tuned.test_after > tuned.test_before:
        typer.echo("The fit does not hold on flights that it has not seen: it is over-fitted.")


def _parse_free(text: str) -> tuple[str, Any]:
    from pydantic import ValidationError

    from tenbaud.studies.study import Range

    match = re.fullmatch(r"([\w.]+)=([^.:]*(?:\.\d[^.:]*)?)\.\.([^:]+)(?::(log|linear))?", text.strip())
    if match is None:
        raise typer.BadParameter(f"--free {text}: write NAME=FROM..TO, and :log for a log scale")
    name, first, last, scale = match.groups()
    try:
        values = {"from": float(first), "to": float(last), "scale": scale or "linear"}
        return name, Range.model_validate(values)
    except (ValueError, ValidationError) as error:
        raise typer.BadParameter(f"--free {text}: {error}") from error


def _bar(total: int) -> Any:
    from contextlib import contextmanager

    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    @contextmanager
    def shown() -> Any:
        columns = (
            TextColumn("{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TimeRemainingColumn(),
        )
        with Progress(*columns, console=Console(stderr=True)) as progress:
            yield progress, progress.add_task("tune", total=total)

    return shown()
