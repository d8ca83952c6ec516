"""`tenbaud transmit` and `tenbaud receive`: one process each."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tenbaud.cli import many, options

if TYPE_CHECKING:
    from channel.links.base import Role

RunFolderOption = Annotated[
    Path | None, typer.Option("--run-folder", hidden=True, help="Existing folder of the run.")
]
StatusOption = Annotated[str, typer.Option(hidden=True, help="auto, lines or none.")]


def transmit(
    preset: options.Preset = None,
    config: options.ConfigFile = None,
    listen: options.Listen = None,
    connect: options.Connect = None,
    session: options.Session = None,
    link: options.Link = None,
    port: options.Port = None,
    line_rate: options.LineRate = None,
    downlink: options.Downlink = None,
    clock: options.Clock = options.ClockOption.REAL,
    duration: options.Duration = None,
    seed: options.Seed = None,
    lead: options.Lead = None,
    delivery: options.Delivery = None,
    rig: Annotated[str | None, typer.Option(help=options.RIG_HELP)] = None,
    dry_run: options.DryRun = False,
    mismatch: Annotated[
        float | None, typer.Option(help="Simulated plant off the codec's model, 0.1 for 10 %.")
    ] = None,
    disturbance: Annotated[
        str | None, typer.Option(help='Torque on the plant, such as "q=2e-3,step=0.5@30".')
    ] = None,
    impair: options.Impair = None,
    on_desync: options.OnDesync = None,
    sabotage: options.Sabotage = None,
    settings: options.Settings = None,
    insecure: options.Insecure = False,
    out: options.Out = None,
    json: options.AsJson = False,
    run_folder: RunFolderOption = None,
    status: StatusOption = "auto",
) -> None:
    """Run the sensor node: the rig, and one bit per sample to the receiver.

    [dim]tenbaud transmit --preset tuned-10baud[/dim]

    [dim]tenbaud transmit --connect tcp/127.0.0.1:7447 --clock virtual --json[/dim]

    [dim]tenbaud transmit --link serial --port /dev/ttyUSB0[/dim]
    """
    changed = options.overrides(
        duration=duration,
        seed=seed,
        lead=lead,
        delivery=delivery,
        session=session,
        link=link,
        port=port,
        line_rate=line_rate,
        downlink=downlink,
        rig=rig,
        dry_run=dry_run,
        mismatch=mismatch,
        disturbance=disturbance,
        impair=impair,
        on_desync=on_desync,
        sabotage=sabotage,
        settings=settings,
    )
    endpoints = (tuple(listen or ()), tuple(connect or ()), insecure)
    _run("transmitter", preset, config, changed, clock, endpoints, out, run_folder, json, status)


def receive(
    preset: options.Preset = None,
    config: options.ConfigFile = None,
    listen: options.Listen = None,
    connect: options.Connect = None,
    session: options.Session = None,
    link: options.Link = None,
    port: options.Port = None,
    line_rate: options.LineRate = None,
    downlink: options.Downlink = None,
    clock: options.Clock = options.ClockOption.REAL,
    lead: options.Lead = None,
    delivery: options.Delivery = None,
    rig: Annotated[
        str | None,
        typer.Option(help="replay:FILE when the transmitter replays: its voltages are used."),
    ] = None,
    impair: options.Impair = None,
    sabotage: options.Sabotage = None,
    settings: options.Settings = None,
    insecure: options.Insecure = False,
    out: options.Out = None,
    json: options.AsJson = False,
    run_folder: RunFolderOption = None,
    status: StatusOption = "auto",
    sessions: options.Sessions = None,
    configs: options.Configs = None,
    rigs_max: options.RigsMax = 100,
    flights: options.Flights = None,
) -> None:
    """Run the controller node: estimates from the bits, commands back to the motors.

    [dim]tenbaud receive --preset tuned-10baud[/dim]

    [dim]tenbaud receive --listen tcp/127.0.0.1:7447 --clock virtual --json[/dim]

    [dim]tenbaud receive --link serial --port /dev/ttyUSB1[/dim]

    [dim]tenbaud receive --sessions 'rig/*' --configs rigs/[/dim]
    """
    changed = options.overrides(
        lead=lead,
        delivery=delivery,
        session=session,
        link=link,
        port=port,
        line_rate=line_rate,
        downlink=downlink,
        rig=rig,
        impair=impair,
        sabotage=sabotage,
        sabotaged_end="receiver",
        settings=settings,
    )
    endpoints = (tuple(listen or ()), tuple(connect or ()), insecure)
    if sessions is not None:
        sources = (preset, config, configs, changed)
        wanted = (sessions, session, rigs_max, flights)
        return many.serve(wanted, sources, clock.value, endpoints, out, json)
    _run("receiver", preset, config, changed, clock, endpoints, out, run_folder, json, status)


def _run(
    role: Role,
    preset: str | None,
    path: Path | None,
    changed: dict[str, Any],
    clock: options.ClockOption,
    addresses: tuple[tuple[str, ...], tuple[str, ...], bool],
    out: Path | None,
    run_folder: Path | None,
    as_json: bool,
    status: str,
) -> None:
    from channel.links.endpoints import DEFAULT_ENDPOINT, check_endpoints
    from tenbaud.build import agree
    from tenbaud.build_ends import check_parts
    from tenbaud.config.load import dump_config, load_config
    from tenbaud.flight import ends
    from tenbaud.flight.outcome import ExitCode
    from tenbaud.recording.folder import RunFolder, create_run_folder

    config = load_config(preset, path, changed)
    agreement = agree(config, clock.value)
    listen, connect, insecure = addresses
    serial = config.link.kind == "serial"
    if serial and config.link.downlink != "zenoh":
        if listen or connect:
            raise typer.BadParameter("--listen and --connect are Zenoh's; a serial line has --port")
    elif not listen and not connect:
        # Without any address both ends meet on this machine: the receiver listens.
        listen = (DEFAULT_ENDPOINT,) if role == "receiver" else ()
        connect = () if role == "receiver" else (DEFAULT_ENDPOINT,)
    check_endpoints(listen + connect, insecure)
    check_parts(config)
    if insecure:
        typer.echo(
            "tenbaud: --insecure: whoever reaches this address can read the symbols and command "
            "the motors; nothing is encrypted or authenticated",
            err=True,
        )
    whole = run_folder is None
    folder = RunFolder(run_folder or create_run_folder(None, f"{role}-{config.preset}", out))
    if whole:
        folder.config.write_text(dump_config(config))
        ports = tuple(filter(None, (config.link.port, config.link.downlink))) if serial else ()
        _introduce(role, agreement.identity, config.seed, ports + listen + connect, folder.path)
    run_end = ends.run_transmitter if role == "transmitter" else ends.run_receiver
    mode = status if status in ("lines", "none") else "auto"
    outcome, summary = run_end(
        agreement,
        ends.Endpoints(listen, connect, insecure),
        folder,
        mode,  # type: ignore[arg-type]
    )
    if whole:
        from tenbaud.flight.report import draw_run, figure_title, write_summary

        write_summary(folder, summary)
        if role == "transmitter" and summary["samples"]:
            problem = draw_run(folder, figure_title(config, summary))
            if problem is not None:
                typer.echo(problem, err=True)
    if as_json:
        ends.write_json(summary)
    elif whole and summary["samples"]:
        from tenbaud.flight.report import show_summary

        show_summary(summary, folder)
    if outcome.code is not ExitCode.OK:
        typer.echo(f"tenbaud {role}: {outcome.text}", err=True)
        raise typer.Exit(int(outcome.code))


def _introduce(role: Role, identity: Any, seed: int, addresses: tuple[str, ...], path: Path) -> None:
    typer.echo(
        f"tenbaud {identity.version} {role}  config {identity.config_digest.hex()[:12]}  "
        f"numerics {identity.numerics_probe.hex()}  seed {seed}\n"
        f"  at {', '.join(addresses)}, recording into {path}",
        err=True,
    )
