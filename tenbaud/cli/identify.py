"""`tenbaud identify`: the model's parameters from a rig, a run or a log."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tenbaud.cli import options
from tenbaud.cli.log_options import LogOptions
from tenbaud.cli.spread import spread

if TYPE_CHECKING:
    from plant_sim.identification.pitch import PitchSettings
    from plant_sim.identification.record import PitchRecord
    from tenbaud.config.schema import FlightConfig
    from tenbaud.identify.run import Identified

EXCITATIONS = ("square:0.2,0,2.5", "square:0.25,0.1,3")
PRINTED_EVERY_S = 10.0
DURATION_S = 60.0
TICKS_MAX = 10_000_000
"""of an experiment, which is in memory as a whole"""


Bandwidth = Annotated[
    float, typer.Option(help="Pass band w_f of the filters, rad/s.", min=0.001, max=1000.0)
]
Damping = Annotated[float, typer.Option(help="Damping rho of the filters.", min=0.01, max=100.0)]
Forgetting = Annotated[float, typer.Option(help="alpha of (10), 1/s.", min=0.0, max=100.0)]


@spread
def identify(
    plant: options.PlantOptions,
    log: LogOptions,
    source: Annotated[
        Path | None,
        typer.Argument(help="A log or the folder of a run; not given: the simulated rig is excited."),
    ] = None,
    duration: options.Duration = None,
    excitation: Annotated[
        list[str] | None,
        typer.Option(
            help="square:HZ,BIAS,MAGNITUDE, prbs:BIT_S,BIAS,MAGNITUDE or "
            "chirp:START,END,DURATION,MAGNITUDE in Hz, s, V; repeatable. Not given: two square waves."
        ),
    ] = None,
    equilibrium: Annotated[
        str, typer.Option(help="theta_0: auto, quiet (a stretch at rest), estimate, or rad.")
    ] = "auto",
    bandwidth: Bandwidth = 1.0,
    damping: Damping = 0.7,
    forgetting: Forgetting = 0.01,
    out: options.Out = None,
    json: options.AsJson = False,
) -> None:
    """Identify the pitch model on-line and write a configuration with it, and Figs. 3 and 4.

    [dim]tenbaud identify[/dim]

    [dim]tenbaud identify flight.csv --set timing.tick_s=0.02 --to 60 --equilibrium estimate[/dim]
    """
    from dataclasses import replace

    from tenbaud.identify.run import run, settings_of

    loaded = plant.load(log=log)
    records = _records(loaded, source, excitation, duration)
    # A log or a run may begin in motion; the filters must forget what they did not see.
    settle_s = 5.0 / bandwidth if source is not None and bandwidth > 0.0 else 0.0
    filters = replace(
        settings_of(loaded, settle_s),
        filter_bandwidth_rad_s=bandwidth,
        filter_damping=damping,
        forgetting_per_s=forgetting,
    )
    found = [run(name, record, equilibrium, filters) for name, record in records]
    _write(loaded, found, filters, out, source is None, json)


def _records(
    config: FlightConfig,
    source: Path | None,
    excitation: list[str] | None,
    duration: float | None,
) -> list[tuple[str, PitchRecord]]:
    from tenbaud.identify.sources import from_log, from_rig

    if source is None:
        rest = config.transmitter.plant.model_copy(
            update={"initial": getattr(config.model, "equilibrium_rad", 0.0)}
        )
        at_rest = config.model_copy(
            update={"transmitter": config.transmitter.model_copy(update={"plant": rest})}
        )
        signals = excitation or list(EXCITATIONS)
        ticks = (duration or DURATION_S) / config.timing.tick_s
        if ticks > TICKS_MAX:
            raise typer.BadParameter(f"--duration: {ticks:.3g} ticks; at most {TICKS_MAX:.3g}")
        return [(signal, from_rig(at_rest, signal, duration or DURATION_S)) for signal in signals]
    named = config.flight_log.model_copy(update={"file": str(source)})
    return [(source.name, from_log(config.model_copy(update={"flight_log": named})))]


def _write(
    config: FlightConfig,
    found: list[Identified],
    filters: PitchSettings,
    out: Path | None,
    simulated: bool,
    as_json: bool,
) -> None:
    from tenbaud.identify.figures import draw_estimates, draw_excitation
    from tenbaud.identify.run import write_config
    from tenbaud.recording.folder import create_run_folder

    folder = create_run_folder(None, "identify", out)
    true = _true_values(config) if simulated else None
    draw_excitation(found, [folder / "figure-3.png", folder / "figure-3.svg"])
    draw_estimates(found, [folder / "figure-4.png", folder / "figure-4.svg"], true)
    for index, one in enumerate(found):
        name = "identified.toml" if index == 0 else f"identified-{index + 1}.toml"
        write_config(folder / name, config, one, filters)
    if as_json:
        options.print_json([_summary(one) for one in found])
    else:
        _show(found)
        typer.echo(f"written to {folder}; fly with it: --config {folder / 'identified.toml'}")
    for one in found:
        for text in one.warnings:
            typer.echo(f"warning, {one.name}: {text}", err=True)


def _true_values(config: FlightConfig) -> tuple[float, ...]:
    from tenbaud.build.rig import nominal_plant

    plant = nominal_plant(config).mismatched(config.transmitter.plant.mismatch)
    return plant.rate_damping_per_s, plant.stiffness_per_s2, plant.torque_gain_rad_per_v_s2


def _summary(one: Identified) -> dict[str, object]:
    from tenbaud.identify.run import FIELDS

    return {
        "source": one.name,
        "estimates": {field: getattr(one.result.estimates, field) for field, _, _ in FIELDS},
        "standard_errors": {field: getattr(one.result.deviations, field) for field, _, _ in FIELDS},
        "cross_check": None
        if one.check is None
        else {field: getattr(one.check.estimates, field) for field, _, _ in FIELDS},
        "excitation": one.result.condition,
        "equilibrium_source": one.equilibrium_source,
        "warnings": list(one.warnings),
    }


def _show(found: list[Identified]) -> None:
    from rich.console import Console
    from rich.table import Table

    from tenbaud.identify.run import FIELDS

    console = Console()
    for one in found:
        result = one.result
        title = f"{one.name}: {one.record.duration_s:.1f} s, excitation {result.condition:.3f}"
        table = Table(title=title, title_justify="left")
        table.add_column("after")
        for _, letter, unit in FIELDS:
            table.add_column(f"{letter}, {unit}", justify="right")
        every = max(1, round(max(PRINTED_EVERY_S, one.record.duration_s / 12) / one.record.step_s))
        for index in range(every, len(one.record), every):
            cells = [f"{value:.4f}" for value in result.history[index]]
            table.add_row(f"{result.times_s[index]:.0f} s", *cells)
        table.add_section()
        table.add_row("estimate", *(f"{value:.4f}" for value in result.estimates))
        table.add_row("std. error", *(f"{value:.4f}" for value in result.deviations))
        if one.check is not None:
            table.add_row("cross-check", *(f"{value:.4f}" for value in one.check.estimates))
        console.print(table)
        console.print(f"theta_0: {one.equilibrium_source}")
