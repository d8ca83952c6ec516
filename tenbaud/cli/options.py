"""The options that several commands share, and how they become configuration."""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from tenbaud.cli import completion, rigs
from tenbaud.cli.log_options import LogOptions as LogOptions

if TYPE_CHECKING:
    from tenbaud.config.schema import FlightConfig


Preset = Annotated[
    str | None,
    typer.Option(
        help="Preset to fly; `tenbaud presets` lists them.", autocompletion=completion.presets
    ),
]
ConfigFile = Annotated[
    Path | None,
    typer.Option("--config", help="TOML file over the preset; the same at both ends."),
]
AllowCode = Annotated[
    bool,
    typer.Option(
        "--allow-code",
        help="Import and run the external classes (module:Class) that the configuration names.",
    ),
]
Duration = Annotated[
    float | None,
    typer.Option(help="Flight time in seconds, or with its unit: 90s, 5min.", min=1e-5, max=1e7),
]
Seed = Annotated[
    int | None,
    typer.Option(help="Seed of all random numbers.", min=0, max=2**63 - 1),
]
Clock = Annotated[
    Literal["real", "virtual"], typer.Option(help="virtual: as fast as possible; real: in real time.")
]
Out = Annotated[
    Path | None, typer.Option(help="New folder for the run; runs/<time>_<name> if not given.")
]
AsJson = Annotated[
    bool, typer.Option("--json", help="Print only the summary, as JSON, on standard output.")
]
Verbose = Annotated[bool, typer.Option("--verbose", help="Also print every figure of the summary.")]
Draw = Annotated[
    bool, typer.Option("--figure/--no-figure", envvar="TENBAUD_FIGURE", help="Draw flight.png or not.")
]
Settings = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        help="Any field, such as --set coder.window_signs=3; repeatable.",
        autocompletion=completion.settings,
    ),
]
Listen = Annotated[list[str] | None, typer.Option(help="Zenoh endpoint to listen on; repeatable.")]
Connect = Annotated[list[str] | None, typer.Option(help="Zenoh endpoint to connect to; repeatable.")]
Mismatch = Annotated[
    float | None,
    typer.Option(help="Model mismatch of the simulated plant, 10% or 0.1."),
]
Rig = Annotated[str | None, typer.Option(help=rigs.FORMS)]
Disturbance = Annotated[
    str | None, typer.Option(help='Torque on the plant, such as "q=2e-3,step=0.5@30".')
]
Impair = Annotated[
    str | None,
    typer.Option(
        help='Impairments of the line, such as "up:loss=0.3,delay=30ms". On a real clock they '
        "apply to outgoing messages; pass the same value to both ends."
    ),
]
OnDesync = Annotated[
    str | None,
    typer.Option(
        "--on-desync",
        help="If the codecs differ: rejoin (continue from a common state) or stop (exit code 5).",
    ),
]
Insecure = Annotated[
    bool,
    typer.Option(
        "--insecure",
        help="Allow addresses beyond this machine without encryption or authentication.",
    ),
]
TakeOver = Annotated[
    bool,
    typer.Option(
        "--take-over",
        help="Take over a running flight from its present receiver.",
    ),
]
Pace = Annotated[
    float | None,
    typer.Option(min=0.05, max=1e6, help="Virtual clock: maximum speed as a multiple of real time."),
]
OpenBrowser = Annotated[
    bool, typer.Option("--open", help="Open the live page in the browser of this machine.")
]
DryRun = Annotated[
    bool, typer.Option("--dry-run", help="Read the rig only: no command is sent to the motors.")
]


@dataclass(frozen=True, slots=True)
class Addresses:
    """Address and identity of the other end."""

    listen: Listen = None
    connect: Connect = None
    router: list[str] | None = None
    """Zenoh router between the ends, instead of --listen and --connect."""
    scout: bool = False
    """Find the other end by multicast in this network."""
    keys: Path | None = None
    """This node's key folder (`tenbaud keys`): TLS, and only named peers."""
    peer: list[str] | None = None
    """With --keys: certificate name accepted at the other end; behind a router the router's name.
    Repeatable. With --sessions, NAME=SESSION restricts it to one session."""
    viewer: list[str] | None = None
    """With --keys: certificate name that may watch but not send. Repeatable."""
    insecure: Insecure = False


@dataclass(frozen=True, slots=True)
class ManyOptions:
    """`--sessions` of `receive`, and its options."""

    sessions: str | None = None
    """Serve every session whose name matches, such as 'rig/*', in this one process."""
    configs: Path | None = None
    """With --sessions: folder of files for single sessions, rig/7.toml for rig/7."""
    rigs_max: Annotated[int, typer.Option(min=1, max=100_000)] = 100
    """With --sessions: maximum number of simultaneous flights."""
    flights: Annotated[int | None, typer.Option(min=1, max=10**9)] = None
    """With --sessions: end after this number of flights."""


@dataclass(frozen=True, slots=True)
class PlantOptions:
    """Configuration and plant of the commands without a link."""

    preset: Preset = None
    config: ConfigFile = None
    mismatch: Mismatch = None
    disturbance: Disturbance = None
    seed: Seed = None
    settings: Settings = None
    allow_code: AllowCode = False

    def load(self, **own: Any) -> FlightConfig:
        """Return the configuration with these options, and the command's own, over it."""
        from tenbaud.build.recorded import flight_config

        changes = overrides(**fields_of(self), **own)
        return flight_config(self.preset, self.config, changes, allow_code=self.allow_code)


@dataclass(frozen=True, slots=True)
class _Configured:
    """Common options of `demo`, `transmit` and `receive`."""

    preset: Preset = None
    config: ConfigFile = None
    lead: int | None = None
    """Command lead D in ticks; chosen from the delivery times if not given."""
    delivery: str | None = None
    """start: a bit arrives at once (the paper); end: at the end of its slot (a wire)."""
    line_rate: int | None = None
    """Bits per second on the serial line (115200)."""
    downlink: str | None = None
    """With --link serial: separate link for the commands, zenoh or a second port. For what comes
    down: --set channel.downlink=... (narrow, compact, full)."""
    impair: Impair = None
    sabotage: str | None = None
    """Corrupt one bit of this end's codec on purpose, such as sample=500,field=range."""
    settings: Settings = None


@dataclass(frozen=True, slots=True)
class FlightOptions(_Configured):
    """The flight of `demo`."""

    clock: Clock = "virtual"
    duration: Duration = None
    seed: Seed = None
    link: str | None = None
    """zenoh: two processes; serial: two processes and an emulated line between them; memory: both ends
    in this process."""
    rig: Rig = None
    dry_run: DryRun = False
    disturbance: Disturbance = None
    on_desync: OnDesync = None


@dataclass(frozen=True, slots=True)
class NodeOptions(_Configured):
    """Common options of `transmit` and `receive`, except addresses."""

    session: str | None = None
    """Session name; the same at both ends."""
    link: str | None = None
    """zenoh, serial with --port, or a kind from an installed package."""
    port: str | None = None
    """Serial port of this end: /dev/ttyUSB0, COM3, socket://HOST:PORT, rfc2217://HOST:PORT."""
    clock: Clock = "real"
    telemetry: str = ""
    """For viewers: on, off, or a Zenoh endpoint to listen on. Not given: on, on a socket that only this
    user can open; off beside an insecure link that leaves this machine."""
    allow_control: bool = False
    """Let viewers change set-point, line and codec in flight; every change is recorded."""
    out: Out = None
    json: AsJson = False
    verbose: Verbose = False
    run_folder: Annotated[Path | None, typer.Option(hidden=True)] = None
    """Existing folder of the run."""
    status: Annotated[str, typer.Option(hidden=True)] = "auto"
    """auto, lines or none."""


FIELDS = {
    "duration": "duration_s",
    "seed": "seed",
    "lead": "timing.lead_ticks",
    "delivery": "channel.delivery",
    "session": "link.session",
    "link": "link.kind",
    "port": "link.port",
    "line_rate": "link.line_rate_baud",
    "downlink": "link.downlink",
    "impair": "link.impairments",
    "mismatch": "transmitter.plant.mismatch",
    "disturbance": "transmitter.plant.disturbance",
    "on_desync": "transmitter.on_desync",
    "dry_run": "transmitter.dry_run",
}
"""Options that set one field of the configuration."""


def fields_of(*groups: Any) -> dict[str, Any]:
    """Return those of groups of options that `overrides` takes."""
    taken = (*FIELDS, "rig", "sabotage", "settings")
    pairs = [(group, one.name) for group in groups for one in fields(group)]
    return {name: getattr(group, name) for group, name in pairs if name in taken}


def overrides(
    *,
    rig: str | None = None,
    log: LogOptions | None = None,
    sabotage: str | None = None,
    sabotaged_end: str = "transmitter",
    settings: list[str] | None = None,
    **options: Any,
) -> dict[str, Any]:
    """Return the configuration that these options set, as nested sections; None and False set nothing.

    `options` are those of `FIELDS`.
    """
    from tenbaud.config.load import nested

    given = {name: value for name, value in options.items() if value is not None and value is not False}
    values = {FIELDS[name]: value for name, value in given.items()}
    if sabotage is not None:
        values[f"{sabotaged_end}.sabotage"] = sabotage
    if rig is not None:
        values |= rigs.settings_of(rig)
    values |= {} if log is None else log.settings()
    return nested(values | dict(_parse_setting(setting) for setting in settings or []))


def print_json(value: object) -> None:
    """Print a result on standard output for programs."""
    import json

    typer.echo(json.dumps(value, indent=2))


def _parse_setting(setting: str) -> tuple[str, Any]:
    import tomllib

    from tenbaud.cli.units import plain_setting

    name, equals, text = setting.partition("=")
    if not equals:
        raise typer.BadParameter(f"--set {setting}: write FIELD=VALUE")
    name, text = name.strip(), plain_setting(name.strip(), text)
    try:
        return name, tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return name, text
