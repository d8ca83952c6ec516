"""`tenbaud tune`: fit a coder's constants on some flights and validate them on others."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from tenbaud.cli import options
from tenbaud.cli.log_options import LogOptions
from tenbaud.cli.spread import spread
from tenbaud.studies.progress import progress_bar

if TYPE_CHECKING:
    from tenbaud.config.schema import FlightConfig
    from tenbaud.studies.tuning import Tuned


@dataclass(frozen=True, slots=True)
class FitOptions:
    """What is fitted, and on which flights."""

    free: list[str] | None = None
    """Constant of coder or model to fit and its range, such as coder.decay=0.7..0.99 or
    coder.minimum_range_rad=0.003..0.1:log; repeatable. Not given: the usual ones of the coder, its
    gains and its range."""
    model: bool = False
    """Fit the pitch model's damping, stiffness, gain, lag and equilibrium as well."""
    seeds: Annotated[int, typer.Option(min=1, max=100_000)] = 6
    """Simulated flights for the fit."""
    test_seeds: Annotated[int, typer.Option(min=1, max=100_000)] = 12
    """Simulated flights for validation, with the next seeds."""
    train_share: Annotated[float, typer.Option(min=0.05, max=0.95)] = 0.5
    """Share of a recorded flight for the fit; the rest is for validation."""
    method: Literal["cma-es", "nelder-mead"] = "cma-es"
    """Search method."""
    evaluations: Annotated[int, typer.Option(min=1, max=10_000_000)] = 600
    """Maximum number of parameter sets, including the configured one; each is flown on all flights for
    the fit."""
    scales: str = "0.6,1,2"
    """Recorded flights: sizes at which the record is flown for the fit."""
    shoves: Annotated[float, typer.Option(min=0.0, max=100.0)] = 1.0
    """Recorded flights: rms of the random pushes added for the fit, as a share of the record's motion;
    0: none."""
    phases: Annotated[int, typer.Option(min=1, max=10_000)] = 5
    """Recorded flights: maximum number of sample phases for the fit; the validation flies all."""
    seed: Annotated[int, typer.Option(min=0, max=2**32 - 1)] = 1
    """Seed of the search."""


@spread
def tune(
    *,
    out: Annotated[Path, typer.Option(help="New file for the fitted preset.")],
    log: LogOptions,
    preset: options.Preset = None,
    config: options.ConfigFile = None,
    rig: Annotated[
        str | None, typer.Option(help="simulated, or replay:FILE to fit on a recorded flight.")
    ] = None,
    duration: options.Duration = None,
    mismatch: options.Mismatch = None,
    disturbance: options.Disturbance = None,
    impair: options.Impair = None,
    settings: options.Settings = None,
    fitting: FitOptions,
    allow_code: options.AllowCode = False,
    as_json: options.AsJson = False,
) -> None:
    """Fit a coder's constants, and with --model the model's, on flights; validate them on others.

    Minimises the receiver's rms estimation error. Simulated flights: --seeds seeds for the fit, and
    --test-seeds others for validation. Recorded flights: the first --train-share for the fit, at
    several sizes, with random pushes added and from several sample phases; the rest for validation, as
    recorded, mean over all phases. Both errors are reported, before and after.

    The preset written to --out has the sections timing, channel, model and coder over the preset that
    the fit started from. It does not contain plant, disturbance, line and recording. Ctrl-C ends the
    search and keeps the best result; a second Ctrl-C ends at once.
    """
    from tenbaud.flight.outcome import ExitCode
    from tenbaud.flight.stop import StopFlag
    from tenbaud.studies.compiled import require

    require("numba", "cma")
    from tenbaud.studies.constants import free_ranges
    from tenbaud.studies.judging import Tuning, split_of
    from tenbaud.studies.records import Augment
    from tenbaud.studies.tuning import preset_text, shown, units_of
    from tenbaud.studies.tuning import tune as fit

    _make_room(out)
    plant: dict[str, Any] = {"rig": rig, "log": log, "mismatch": mismatch, "disturbance": disturbance}
    overrides = options.overrides(duration=duration, impair=impair, settings=settings, **plant)
    tuning = Tuning(
        preset,
        config,
        overrides,
        {},
        split_of(fitting.seeds, fitting.test_seeds, fitting.train_share),
        fitting.method,
        fitting.evaluations,
        fitting.seed,
        allow_code,
        Augment(_sizes(fitting.scales), fitting.shoves, fitting.phases, fitting.seed),
    )
    start = tuning.config({})
    tuning.free.update(free_ranges(start, _named(fitting.free or []), model=fitting.model))
    _need_chance(start)
    units = units_of(start)
    with StopFlag() as stop, progress_bar("tune", counted=True) as update:
        most = fitting.evaluations
        tuned = fit(tuning, lambda n, error: update(n, most, f"best {shown(error, units)}"), stop)
    _leave(tuned, preset_text(tuning, tuned), out, as_json)
    if stop.raised:
        typer.echo(f"stopped after {tuned.evaluations} of {most} evaluations", err=True)
        raise typer.Exit(ExitCode.INTERRUPTED)


def _need_chance(config: FlightConfig) -> None:
    """Refuse simulated flights that are equal for all seeds: the validation would repeat the fit."""
    from channel.line.impairments import parse_impairments
    from plant_sim.disturbance import is_random
    from tenbaud.config.kinds import FMU, PLANTS
    from tenbaud.studies.settings import StudyError

    kind, faults = config.plant_kind, parse_impairments(config.link.impairments)
    if (
        config.transmitter.rig != "simulated"
        or kind == FMU
        or kind not in PLANTS.built_in
        or is_random(config.transmitter.plant.disturbance)
        or faults.up.random
        or faults.down.random
    ):
        return
    raise StudyError(
        "nothing is random in these flights: every seed gives the same flight, and the validation "
        "would repeat the fit. Add a random disturbance, such as --disturbance q=2e-3, or random "
        "faults of the line, such as --impair loss=0.05"
    )


def _make_room(out: Path) -> None:
    """Make the folder of the preset; an error if it cannot be written, before any flight."""
    from tenbaud.files.whole import check_room, make_folder
    from tenbaud.studies.settings import StudyError

    if out.exists():
        raise StudyError(f"{out} exists already; name another file")
    make_folder(out.parent)
    check_room(out)


def _leave(tuned: Tuned, preset: str, out: Path, as_json: bool) -> None:
    """Print the result, and write it."""
    from tenbaud.files.whole import write_whole
    from tenbaud.studies.tuning import report

    if not as_json:
        constants = [f"{name:36} {value:.6g}" for name, value in tuned.values.items()]
        typer.echo("\n".join([*constants, *report(tuned)]))
    # After the figures, so that a full disk does not lose them.
    write_whole(out, preset)
    if as_json:
        options.print_json({**tuned._asdict(), "preset_file": str(out)})
    else:
        typer.echo(f"{out}: fly it with --config {out}")


def _sizes(text: str) -> tuple[float, ...]:
    try:
        return tuple([float(one) for one in text.split(",")])
    except ValueError as error:
        raise typer.BadParameter(f"--scales {text}: write numbers, such as 0.6,1,2") from error


def _named(texts: list[str]) -> dict[str, Any]:
    named: dict[str, Any] = {}
    for text in texts:
        name, ends = _parse_free(text)
        if name in named:
            raise typer.BadParameter(f"--free {text}: {name} is named twice")
        named[name] = ends
    return named


def _parse_free(text: str) -> tuple[str, Any]:
    from pydantic import ValidationError

    from tenbaud.studies.study_file import Range

    match = re.fullmatch(r"([\w.]+)=([^.:]*(?:\.\d[^.:]*)?)\.\.([^:]+)(?::(log|linear))?", text.strip())
    if match is None:
        raise typer.BadParameter(f"--free {text}: write NAME=FROM..TO, and :log for a log scale")
    name, first, last, scale = match.groups()
    try:
        values = {"from": float(first), "to": float(last), "scale": scale or "linear"}
        return name, Range.model_validate(values)
    except ValidationError as error:
        why = error.errors()[0]["msg"].removeprefix("Value error, ")
        raise typer.BadParameter(f"--free {text}: {why}") from error
    except ValueError as error:
        raise typer.BadParameter(f"--free {text}: both ends are numbers") from error
