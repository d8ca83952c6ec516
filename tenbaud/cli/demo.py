"""`tenbaud demo`: both ends on this machine, and a figure."""

from __future__ import annotations

import shlex
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import typer

from tenbaud.cli import options
from tenbaud.cli.log_options import LogOptions
from tenbaud.cli.motors import MotorOptions, confirm_motors
from tenbaud.cli.spread import spread

if TYPE_CHECKING:
    from tenbaud.build.flight import Agreement
    from tenbaud.flight.demo import DemoResult
    from tenbaud.flight.viewing import ViewOptions
    from tenbaud.recording.folder import RunFolder

DEFAULT_PRESET = "tuned-10baud"
DEFAULT_MISMATCH = 0.1
"""No model is exact."""
OF_OUTPUT = ("out", "json", "verbose", "view", "view_port", "open_browser")
"""Options that change nothing of what is flown."""
VIEW_DURATION_S = 3600.0
"""A viewed flight lasts until it is stopped, or this long."""


@spread
def demo(
    context: typer.Context,
    flight: options.FlightOptions,
    log: LogOptions,
    risk: MotorOptions,
    mismatch: options.Mismatches = None,
    view: options.View = False,
    view_port: options.ViewPort = 8710,
    open_browser: options.OpenBrowser = False,
    pace: options.Pace = None,
    figure: options.Draw = True,
    out: options.Out = None,
    json: options.AsJson = False,
    verbose: options.Verbose = False,
) -> None:
    """Fly both ends on this machine: two processes, one bit per sample between them.

    [dim]tenbaud demo[/dim]

    [dim]tenbaud demo --preset paper-10baud --mismatch 0 --mismatch 10%[/dim]

    [dim]tenbaud demo --clock real --duration 20[/dim]

    [dim]tenbaud demo --view[/dim]

    [dim]tenbaud demo --impair "loss=0.3,up:flip=0.02" --sabotage sample=700,field=range[/dim]
    """
    if view and flight.duration is None and flight.config is None:
        flight = replace(flight, duration=VIEW_DURATION_S)
    flights: list[float | None] = list(mismatch or (None,))
    rig = flight.rig or "simulated"
    if flight.preset is None and flight.config is None and not rig.startswith("replay"):
        flight = replace(flight, preset=DEFAULT_PRESET)
        own = any(one.startswith(("model.", "transmitter.plant.")) for one in flight.settings or ())
        exact = own or rig != "simulated"
        flights = list(mismatch or (None if exact else DEFAULT_MISMATCH,))
    changes = [options.overrides(**options.fields_of(flight), mismatch=off, log=log) for off in flights]
    agreements = _agree_all(flight, changes, risk)
    pace = _checked_pace(agreements[0], pace, view)
    view_options = _view_options(agreements, view, view_port, open_browser)
    from tenbaud.flight.demo import fly_demo

    fly = partial(fly_demo, draw=figure, view=view_options, pace=pace, compare=True)
    shown = len(agreements) == 1 and agreements[0].clock == "virtual" and not view
    then = _on_the_page(context) if shown and not agreements[0].link.in_process else None
    raise typer.Exit(_fly_all(agreements, out, json, verbose, fly, then))


def _on_the_page(context: typer.Context) -> str:
    """Return the command that flies what this one flew, with the live page."""
    words = []
    for option in context.command.params:
        source, name = context.get_parameter_source(option.name or ""), option.name or ""
        if name in OF_OUTPUT or source is None or source.name != "COMMANDLINE":
            continue
        value = context.params[name]
        for one in value if getattr(option, "multiple", False) else [value]:
            if getattr(option, "is_flag", False):
                words.append((option.opts if one else option.secondary_opts)[0])
            else:
                words += [option.opts[0], str(one)]
    return shlex.join(["tenbaud", "demo", *words, "--view"])


def _checked_pace(agreement: Agreement, pace: float | None, view: bool) -> float | None:
    """Return the highest multiple of real time; for a viewed flight it is 1."""
    virtual = agreement.clock == "virtual" and not agreement.link.in_process
    if pace is not None and not virtual:
        raise typer.BadParameter("--pace slows the virtual clock of two processes down, and no other")
    return pace or (1.0 if view and virtual else None)


def _view_options(
    agreements: list[Agreement], view: bool, port: int, open_browser: bool
) -> ViewOptions | None:
    """Return the options of the view, if any, checked before anything starts."""
    if not view:
        if open_browser:
            raise typer.BadParameter("--open opens the live page; it goes with --view")
        return None
    from channel.links.endpoints import loopback_host
    from tenbaud.flight.viewing import ViewOptions
    from tenbaud.view.server import Address, require_nicegui

    if len(agreements) > 1 or agreements[0].link.in_process:
        raise typer.BadParameter("--view shows one flight of two processes: one --mismatch, no memory")
    require_nicegui()
    return ViewOptions(Address(loopback_host(), port).checked().port, open_browser)


def _agree_all(
    flight: options.FlightOptions, changes: list[dict[str, Any]], risk: MotorOptions
) -> list[Agreement]:
    """Return the flights, each checked as far as it can be before anything starts."""
    from tenbaud.build.ends import check_parts, check_rig, check_sabotage
    from tenbaud.build.flight import agree
    from tenbaud.build.recorded import flight_config, replay_notes

    configs = [
        flight_config(flight.preset, flight.config, change, allow_code=True) for change in changes
    ]
    agreements = [agree(one, flight.clock.value) for one in configs]
    for agreement in agreements:
        check_parts(agreement.config)
        motors = check_rig(agreement.config, risk.accept_risk)
        check_sabotage(agreement)
    for note in replay_notes(configs[0]):
        typer.echo(f"  {note}", err=True)
    if motors:
        confirm_motors(configs[0], risk.yes)
    return agreements


def _fly_all(
    agreements: list[Agreement],
    out: options.Out,
    as_json: bool,
    verbose: bool,
    fly: Callable[..., DemoResult],
    then: str | None,
) -> int:
    from tenbaud.flight.display import StatusDisplay
    from tenbaud.flight.report import removed_as_not_begun, removed_unless_begun, show_summaries
    from tenbaud.recording.folder import RunFolder, create_run_folder

    results: list[DemoResult] = []
    folders: list[RunFolder] = []
    for index, agreement in enumerate(agreements):
        explicit = out
        if out is not None and index:
            explicit = out.with_name(f"{out.name}-{index + 1}")
        folder = RunFolder(create_run_folder(None, agreement.config.preset, explicit))
        with removed_unless_begun(folder), StatusDisplay() as display:
            result = fly(agreement, folder, display.show)
        begun = not removed_as_not_begun(folder, result.summary, result.code)
        if as_json:
            options.print_json(result.summary)
        elif begun:
            results.append(result)
            folders.append(folder)
        outcome = str(result.summary["outcome"]).partition("\n")[0]
        for message in result.messages:
            # The closing lines begin with the outcome.
            if as_json or not begun or outcome not in message:
                typer.echo(message if begun else f"tenbaud: {message}", err=True)
        if result.code:
            break
    if results:
        show_summaries([result.summary for result in results], folders, verbose=verbose, then=then)
    return int(result.code)
