"""`tenbaud identify`: a plant's parameters from a rig, a run, its bits or a log."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tenbaud.cli import options
from tenbaud.cli.log_options import LogOptions
from tenbaud.cli.spread import spread
from tenbaud.flight.outcome import ExitCode

if TYPE_CHECKING:
    from tenbaud.identification.api import Result

PRINTED_EVERY_S = 10.0


@dataclass(frozen=True, slots=True)
class MethodOptions:
    """From what a plant is identified, and how."""

    source: Annotated[Path | None, typer.Argument()] = None
    """A log or the folder of a run; not given: excite the simulated rig."""
    structure: str = ""
    """pitch, first-order, integrator, integrator:ORDER, siso:N,M or linear; chosen by model and signals
    if not given."""
    lag: str = "auto"
    """Motor lag: auto (model.motor_lag_s if set, else estimated), or s."""
    duration: options.Duration = None
    excitation: list[str] | None = None
    """square:HZ,BIAS,MAGNITUDE, prbs:BIT_S,BIAS,MAGNITUDE or chirp:START,END,DURATION,MAGNITUDE in Hz,
    s, V; repeatable. Not given: two square waves."""
    equilibrium: str = "auto"
    """theta_0: auto, quiet (an interval at rest), estimate, or rad."""
    bandwidth: Annotated[float | None, typer.Option(min=1e-6, max=1000.0)] = None
    """Pass band w_f of the filters, rad/s; near the frequency of the motion if not given."""
    damping: Annotated[float, typer.Option(min=0.01, max=100.0)] = 0.7
    """Damping rho of the filters."""
    forgetting: Annotated[float | None, typer.Option(min=0.0, max=100.0)] = None
    """alpha of (10), 1/s; 0.01 for an experiment, 0 for a record, if not given."""
    from_bits: bool = False
    """Use only the transmitted data of a run: symbols and commands."""
    fly: Annotated[bool, typer.Option("--fly/--no-fly")] = True
    """Fly the record with the identified model."""
    figure: Annotated[bool, typer.Option("--figure/--no-figure", envvar="TENBAUD_FIGURE")] = True
    """Draw Figs. 3 and 4 or not."""


@spread
def identify(
    plant: options.PlantOptions,
    log: LogOptions,
    method: MethodOptions,
    out: options.Out = None,
    json: options.AsJson = False,
) -> None:
    """Identify a plant, write a configuration that flies it, and Figs. 3 and 4.

    Exit code 1, and no configuration, if the data support no model, or none that flies.

    [dim]tenbaud identify[/dim]

    [dim]tenbaud identify flight.csv --columns angle=pitch,front=u1,rear=u2,time=t --unit deg[/dim]

    [dim]tenbaud identify runs/first --from-bits[/dim]
    """
    from tenbaud.config.load import given_names
    from tenbaud.identification.api import Request, identify_sources, sources_of

    loaded = plant.load(log=log)
    given = given_names(plant.config, options.overrides(**options.fields_of(plant), log=log))
    given |= {"preset"} if plant.preset else set()
    request = Request(
        method.structure,
        method.lag,
        method.equilibrium,
        method.bandwidth,
        method.damping,
        method.forgetting,
        fly=method.fly,
        given=frozenset(given),
        from_bits=method.from_bits,
    )
    duration = method.duration
    if duration is not None and duration / loaded.timing.tick_s > 10_000_000:
        raise typer.BadParameter(f"--duration: {duration / loaded.timing.tick_s:.3g} ticks")
    sources = sources_of(loaded, method.source, request, method.excitation, duration)
    result = identify_sources(loaded, sources, request)
    _write(result, out, method, json)
    if not result.supported:
        raise typer.Exit(int(ExitCode.FAILED))


def _write(result: Result, out: Path | None, method: MethodOptions, as_json: bool) -> None:
    from tenbaud.recording.folder import create_run_folder

    folder = create_run_folder(None, "identify", out)
    result.save(folder, fly=method.fly, draw=method.figure)
    if as_json:
        options.print_json([one.summary() for one in result.each])
    else:
        _show(result)
    for one in result.each:
        for text in one.identified.warnings:
            typer.echo(f"warning, {one.identified.name}: {text}", err=True)
        for text in one.identified.found.refused:
            typer.echo(f"not supported, {one.identified.name}: {text}", err=True)
        if one.identified.advice:
            typer.echo(
                f"no model was written of {one.identified.name}: {one.identified.advice}", err=True
            )
    if as_json:
        return
    for one in result.each:
        if one.config_file is not None and one.flown is not None:
            typer.echo(f"{one.identified.name}: {one.flown.sentence()}")
    written = [one.config_file for one in result.each if one.config_file is not None]
    said = f"; fly with it: --config {written[0]}" if written else "; no model is in it"
    typer.echo(f"written to {folder}{said}")


def _show(result: Result) -> None:
    from rich.console import Console
    from rich.table import Table

    from tenbaud.identification.beside import MEASURED
    from tenbaud.identification.figures import history_of

    console = Console()
    for each in result.each:
        one, record = each.identified, each.identified.record
        found, regression = one.found, one.found.regression
        title = f"{one.name}: {record.duration_s:.1f} s, excitation {regression.condition:.3f}"
        table = Table(title=title, title_justify="left")
        table.add_column("after")
        for item in found.parameters:
            table.add_column(
                f"{item.letter}, {item.unit}" if item.unit else item.letter, justify="right"
            )
        times = regression.times_s
        every = max(PRINTED_EVERY_S, record.duration_s / 12)
        marks = [mark * every for mark in range(1, int(times[-1] / every) + 1)]
        rows = [min(len(times) - 1, int(times.searchsorted(mark))) for mark in marks]
        for row, values in zip(rows, history_of(regression, rows), strict=True):
            table.add_row(f"{times[row]:.0f} s", *(f"{value:.4f}" for value in values))
        table.add_section()
        table.add_row("estimate", *(f"{item.value:.4f}" for item in found.parameters))
        table.add_row("std. error", *(f"{item.deviation:.4f}" for item in found.parameters))
        if found.check is not None:
            other = found.structure.parameters(found.check.values, found.check.covariance)
            if found.by_simulation:
                other = found.structure.parameters(regression.values, regression.covariance)
            name = "regression" if found.by_simulation else "simulation fit"
            table.add_row(name, *(f"{item.value:.4f}" for item in other))
        table.add_section()
        for where, values in each.beside.items():
            table.add_row(where, *(f"{value:.4f}" for value in values))
            pairs = zip(found.parameters, values, strict=True)
            off = [
                f"{100.0 * (item.value / value - 1.0):+.2f} %" if value else "" for item, value in pairs
            ]
            table.add_row("off them" if where == MEASURED else "off it", *off)
        console.print(table)
        for line in each.lines():
            console.print(line, highlight=False, markup=False)
