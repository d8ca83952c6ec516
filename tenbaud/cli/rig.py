"""`tenbaud rig`: an emulated device. `rig-check` and `doctor`: check the rig, and the machine."""

from __future__ import annotations

import json as json_module
import shlex
import sys
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tenbaud.cli import options
from tenbaud.cli.spread import spread
from tenbaud.flight.outcome import ExitCode

if TYPE_CHECKING:
    from tenbaud.config.schema import FlightConfig
    from transmitter.rigs.emulator.device import RigEmulator


@dataclass(frozen=True, slots=True)
class DeviceOptions:
    """The emulated device and its line."""

    form: Annotated[str, typer.Option("--format")] = "cobs"
    """ascii, cobs, quarc or qsb."""
    port: str = "pty"
    """pty, pty:LINK (a name for it), /dev/NAME, tcp:HOST:PORT (0: any) to listen,
    tcp-connect:HOST:PORT."""
    replay: str | None = None
    """Recorded flight that drives the encoder instead of a body."""
    samples_per_s: Annotated[float | None, typer.Option("--rate", min=1.0, max=5000.0)] = None
    """Samples per second; 480 for cobs."""
    lines: str = "checked"
    """ascii: checked (E,...*HH), plain (t_us,c0,c1,c2), counts (c0 c1 c2)."""
    polled: Annotated[bool, typer.Option()] = False
    """ascii: answer each line `e` with a sample."""
    watchdog: Annotated[float, typer.Option(min=0.001, max=3600.0)] = 0.1
    """Seconds without a command until the outputs turn off."""
    fault: list[str] | None = None
    """Such as stuck@5..8, silent@5, unplug@5..7, reset@5, drop=0.01; repeatable."""
    duration: Annotated[float | None, typer.Option(min=0.0, max=1e7)] = None
    """Seconds to run; until Ctrl-C if not given."""


@spread
def rig(
    body: options.PlantOptions,
    log: options.LogOptions,
    device: DeviceOptions,
    json: options.AsJson = False,
) -> None:
    """Emulate a rig in real time: encoders, motors, a watchdog, and faults on request.

    [dim]tenbaud rig --format cobs --port pty:./rig --mismatch 0.1[/dim]

    [dim]tenbaud rig --format quarc --port tcp:127.0.0.1:18000 --fault silent@10[/dim]
    """
    from tenbaud.build.emulator import build_emulator

    replay = None if device.replay is None else f"replay:{device.replay}"
    config = body.load(rig=replay, log=log)
    emulator = build_emulator(
        config,
        device.form,  # type: ignore[arg-type]
        device.port,
        line_form=device.lines,
        polled=device.polled,
        samples_per_s=device.samples_per_s,
        watchdog_s=device.watchdog,
        faults=tuple(device.fault or ()),
    )
    _emulate(emulator, device.form, device.duration, json, _flight_words(body, config))


def _emulate(
    emulator: RigEmulator, form: str, duration_s: float | None, as_json: bool, flight: list[str]
) -> None:
    import time

    from tenbaud.flight.stop import StopFlag

    with StopFlag() as stop:
        emulator.line.plug()
        address = emulator.line.address
        # The first line, so that a script can read where the device is.
        sys.stdout.write(json_module.dumps({"port": address}) + "\n" if as_json else f"{address}\n")
        sys.stdout.flush()
        typer.echo(f"tenbaud rig: {form} at {address}; Ctrl-C ends it", err=True)
        typer.echo(f"  {_hint(form, address, flight)}", err=True)
        until = None if duration_s is None else time.monotonic() + duration_s
        try:
            emulator.run(lambda: stop() or (until is not None and time.monotonic() > until))
        finally:
            emulator.line.unplug()
    figures = emulator.figures()
    if as_json:
        sys.stdout.write(json_module.dumps(figures) + "\n")
    else:
        typer.echo(", ".join(f"{name} {value}" for name, value in figures.items()))


def _flight_words(body: options.PlantOptions, config: FlightConfig) -> list[str]:
    """Return the options of a flight of this rig, safe ones as for a real rig."""
    from tenbaud.build.first_contact import as_options, first_settings
    from tenbaud.build.signals import configured_signals

    # The paper's constants, the default of `transmit`, lose the small angles of a first flight.
    words = ["--preset", body.preset or "tuned-10baud"] if body.preset or not body.config else []
    words += ["--config", str(body.config)] if body.config else []
    for one in body.settings or ():
        words += ["--set", one]
    given = [shlex.join(words)] if words else []
    return [*given, as_options(first_settings(config, configured_signals(config)))]


def _hint(form: str, address: str, flight: list[str]) -> str:
    where = f"{form}:{address}"
    if form != "quarc" and not address.startswith("/"):
        where = f"{form}:socket://{address}" if ":" in address else where
    if form == "qsb":
        return f"look at it with: tenbaud rig-check --rig {where}"
    # An emulator can hurt no person, so its flight asks no question.
    command = f"fly it with: tenbaud demo --clock real --yes --rig {shlex.quote(where)}"
    return " ".join([command, *flight])


def rig_check(
    rig: options.Rig = None,
    preset: options.Preset = None,
    config: options.ConfigFile = None,
    seconds: Annotated[float, typer.Option(help="Seconds to read.", min=0.1, max=86_400.0)] = 10.0,
    settings: options.Settings = None,
    write: Annotated[
        Path | None, typer.Option(help="New file for the proposed settings of a first flight.")
    ] = None,
    json: options.AsJson = False,
) -> None:
    """Read encoders and check the samples; motors stay disabled.

    Turn each axis by hand to both of its ends while it runs: counts, angles, rates and gaps are shown,
    and the limits of a first flight that follow from them.

    [dim]tenbaud rig-check --rig cobs:/dev/ttyACM0[/dim]

    [dim]tenbaud rig-check --rig cobs:/dev/ttyACM0 --write rig.toml[/dim]
    """
    from tenbaud.build.recorded import flight_config
    from tenbaud.checks.rigcheck import check_rig, show_check
    from tenbaud.config.load import given_values, merged, nested, toml_text
    from tenbaud.files.whole import write_whole

    if write is not None and write.exists():
        raise typer.BadParameter(f"--write {write}: it exists already; name a new file")
    changed = options.overrides(rig=rig, settings=settings)
    result = check_rig(flight_config(preset, config, changed), seconds, live=not json)
    if write is not None:
        values = merged(given_values(config, changed), nested(result.proposal))
        write_whole(write, toml_text(values))
        whole = f"{config} and " if config else ""
        typer.echo(
            f"{whole}the proposed settings are in {write}: check them, then fly with --config {write}",
            err=True,
        )
    if json:
        options.print_json(asdict(result))
    else:
        show_check(result)
    if result.problems:
        raise typer.Exit(int(ExitCode.FAILED))


def doctor(
    preset: options.Preset = None,
    config: options.ConfigFile = None,
    connect: options.Connect = None,
    settings: options.Settings = None,
    allow_code: options.AllowCode = False,
    json: options.AsJson = False,
) -> None:
    """Check ports, permissions, clock, arithmetic and Zenoh; print a report to paste.

    Exit code 1 if there is a problem.

    [dim]tenbaud doctor[/dim]

    [dim]tenbaud doctor --connect tcp/192.168.1.20:7447[/dim]

    [dim]tenbaud doctor --preset tuned-10baud --set channel.downlink=narrow[/dim]
    """
    from tenbaud.checks.doctor import examine, report
    from tenbaud.config.load import load_config

    changes = options.overrides(settings=settings)
    flown = load_config(preset, config, changes, allow_code=allow_code)
    findings = examine(flown, tuple(connect or ()))
    if json:
        options.print_json([asdict(finding) for finding in findings])
    else:
        typer.echo(report(findings))
    if any(finding.state == "problem" for finding in findings):
        raise typer.Exit(int(ExitCode.FAILED))
