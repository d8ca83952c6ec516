"""`tenbaud transmit` and `tenbaud receive`: one process each."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tenbaud.cli import options
from tenbaud.cli.log_options import LogOptions
from tenbaud.cli.motors import MotorOptions, confirm_motors
from tenbaud.cli.spread import spread

if TYPE_CHECKING:
    from channel.links.base import Role
    from tenbaud.config.schema import FlightConfig
    from tenbaud.flight.ends import Endpoints
    from tenbaud.recording.folder import RunFolder


@dataclass(frozen=True, slots=True)
class SensorOptions:
    """The options of the transmitter alone."""

    duration: options.Duration = None
    seed: options.Seed = None
    rig: options.Rig = None
    dry_run: options.DryRun = False
    mismatch: options.Mismatch = None
    disturbance: options.Disturbance = None
    on_desync: options.OnDesync = None
    pace: options.Pace = None
    figure: options.Draw = True


@spread
def transmit(
    node: options.NodeOptions,
    addresses: options.Addresses,
    log: LogOptions,
    risk: MotorOptions,
    sensor: SensorOptions,
) -> None:
    """Run the sensor node: the rig, and one bit per sample to the receiver.

    [dim]tenbaud transmit --preset tuned-10baud[/dim]

    [dim]tenbaud transmit --connect tcp/127.0.0.1:7447 --clock virtual --json[/dim]

    [dim]tenbaud transmit --keys keys/rig --peer desk --connect tls/10.0.0.2:7447[/dim]

    [dim]tenbaud transmit --link serial --port /dev/ttyUSB0[/dim]
    """
    changed = options.overrides(**options.fields_of(node, sensor), log=log)
    if sensor.pace is not None and node.clock != "virtual":
        raise typer.BadParameter("--pace slows the virtual clock down; the real one cannot be paced")
    _run("transmitter", node, addresses, changed, pace=sensor.pace, figure=sensor.figure, risk=risk)


@spread
def receive(
    node: options.NodeOptions,
    addresses: options.Addresses,
    rigs: options.ManyOptions,
    log: LogOptions,
    rig: Annotated[
        str | None,
        typer.Option(help="replay:FILE when the transmitter replays: use the recorded voltages."),
    ] = None,
    take_over: options.TakeOver = False,
) -> None:
    """Run the controller node: estimates from the bits, commands back to the motors.

    [dim]tenbaud receive --preset tuned-10baud[/dim]

    [dim]tenbaud receive --listen tcp/127.0.0.1:7447 --clock virtual --json[/dim]

    [dim]tenbaud receive --keys keys/desk --peer rig --listen tls/10.0.0.2:7447[/dim]

    [dim]tenbaud receive --link serial --port /dev/ttyUSB1[/dim]

    [dim]tenbaud receive --sessions 'rig/*' --configs rigs/[/dim]
    """
    own = options.fields_of(node)
    changed = options.overrides(**own, rig=rig, log=log, sabotaged_end="receiver")
    if rigs.sessions is None:
        if rigs.configs is not None or rigs.flights is not None:
            raise typer.BadParameter("--configs and --flights go with --sessions, the names to serve")
        _run("receiver", node, addresses, changed, take_over=take_over)
        return
    from tenbaud.cli import many

    if node.session is not None:
        raise typer.BadParameter("give --session for one rig or --sessions for many, not both")
    if take_over:
        raise typer.BadParameter("--take-over is for one rig's flight; give its --session")
    if node.allow_control or node.telemetry not in ("", "off"):
        raise typer.BadParameter(
            "--telemetry and --allow-control are for one rig's flight; among many --sessions the "
            "transmitters have telemetry of their own"
        )
    many.serve(rigs, node, addresses, changed)


def _run(
    role: Role,
    node: options.NodeOptions,
    addresses: options.Addresses,
    changed: dict[str, Any],
    *,
    take_over: bool = False,
    pace: float | None = None,
    figure: bool = False,
    risk: MotorOptions | None = None,
) -> None:
    """Run one end; `risk` is that of the transmitter, which has the rig and the flight's length."""
    from contextlib import nullcontext
    from dataclasses import replace

    from tenbaud.build.ends import check_flight, check_parts
    from tenbaud.build.flight import agree
    from tenbaud.build.recorded import flight_config
    from tenbaud.cli.addresses import endpoints_of
    from tenbaud.config.load import dump_config
    from tenbaud.files.whole import write_whole
    from tenbaud.flight import ends
    from tenbaud.flight.outcome import ExitCode, first_code
    from tenbaud.flight.report import removed_as_not_begun, removed_unless_begun, write_up
    from tenbaud.recording.folder import RunFolder, create_run_folder
    from tenbaud.telemetry.end import TelemetryOptions

    config = flight_config(node.preset, node.config, changed, allow_code=True)
    _check_link(config, addresses.insecure)
    telemetry = TelemetryOptions(node.telemetry, node.allow_control, pace)
    agreement = replace(agree(config, node.clock), live=telemetry.control)
    endpoints = replace(endpoints_of(role, addresses, config, take_over), telemetry=telemetry)
    if risk is None:
        check_parts(config)
    elif check_flight(agreement, risk.accept_risk):
        confirm_motors(config, risk.yes)
    telemetry.check(role, endpoints.insecure, endpoints.security is not None)
    whole = node.run_folder is None
    folder = RunFolder(node.run_folder or create_run_folder(None, f"{role}-{config.preset}", node.out))
    run_end = ends.run_transmitter if role == "transmitter" else ends.run_receiver
    mode = node.status if node.status in ("lines", "none") else "auto"
    with removed_unless_begun(folder) if whole else nullcontext():
        if whole:
            write_whole(folder.config, dump_config(config))
            _introduce(role, agreement.identity, config, endpoints, folder)
        outcome, summary = run_end(agreement, endpoints, folder, mode)  # type: ignore[arg-type]
    problems = write_up(folder, config, summary, figure and summary["samples"] > 0) if whole else []
    begun = not whole or not removed_as_not_begun(folder, summary, outcome.code)
    if node.json:
        options.print_json(summary)
    elif whole and begun and summary["samples"]:
        from tenbaud.flight.report import show_summaries

        show_summaries([summary], [folder], verbose=node.verbose)
    # What ended the flight is said last.
    for one in (*problems, *([outcome] if outcome.code is not ExitCode.OK else [])):
        typer.echo(f"tenbaud {role}: {one.text}", err=True)
    code = first_code(outcome.code, *(problem.code for problem in problems))
    if code is not ExitCode.OK:
        raise typer.Exit(int(code))


def _check_link(config: FlightConfig, insecure: bool) -> None:
    """Refuse, before there is a run folder, a link that one end by itself cannot open."""
    from tenbaud.build.flight import kind_of_link

    kind = kind_of_link(config)
    if kind.in_process:
        raise typer.BadParameter(
            f"link.kind = {config.link.kind} joins two ends in one process: "
            f"`tenbaud demo --link {config.link.kind}`"
        )
    kind.check(config.link, insecure)


def _introduce(
    role: Role, identity: Any, config: FlightConfig, endpoints: Endpoints, folder: RunFolder
) -> None:
    from tenbaud.build.flight import kind_of_link
    from tenbaud.build.recorded import replay_notes

    own = kind_of_link(config).where(config.link)
    places = [*own, *endpoints.listen, *endpoints.connect, *endpoints.router]
    if endpoints.scouting:
        places.append("whatever answers in this network")
    typer.echo(
        f"tenbaud {identity.version} {role}  config {identity.config_digest.hex()[:12]}  "
        f"numerics {identity.numerics_probe.hex()}  seed {config.seed}\n"
        f"  at {', '.join(places)}, recording into {folder.path}",
        err=True,
    )
    for note in replay_notes(config):
        typer.echo(f"  {note}", err=True)
