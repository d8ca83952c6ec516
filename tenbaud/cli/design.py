"""`tenbaud floor` and `tenbaud design`: the least error at a rate, and a coder that approaches it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tenbaud.cli import options
from tenbaud.flight.outcome import ExitCode

if TYPE_CHECKING:
    from channel.codec.signals import Signal
    from tenbaud.design.plant import Floors


def floor(
    preset: options.Preset = None,
    config: options.ConfigFile = None,
    plant: Annotated[
        str | None, typer.Option(help="A linear plant by name instead of a configuration's.")
    ] = None,
    rate: Annotated[
        float | None, typer.Option(help="Rate in bit/s; the flight's if not given.", min=1e-6, max=1e9)
    ] = None,
    json: options.AsJson = False,
) -> None:
    """Print the smallest rate that a plant needs, and the least error that a rate allows.

    Both hold for any code. Exit code 1 if the rate is too low.

    [dim]tenbaud floor --preset paper-10baud[/dim]

    [dim]tenbaud floor --plant pendulum --rate 20[/dim]
    """
    from tenbaud.build.codec import configured_rate
    from tenbaud.config.load import load_config
    from tenbaud.design.described import linear_of, plant_of, plant_section
    from tenbaud.design.plant import floors

    period = None
    if plant is not None:
        section: Any = _known(plant_section, plant)
        tick_s = 0.01
    else:
        # Its codec is not built: that would refuse a rate that is too low.
        flown = load_config(preset, config)
        section, tick_s = flown.model, flown.timing.tick_s
        if rate is None:
            period, rate = flown.timing.symbol_period_s, configured_rate(flown)
    if rate is None:
        raise typer.BadParameter("give --rate for a plant by name")
    linear, described = linear_of(section), _known(plant_of, section, tick_s)
    if linear is None:
        raise typer.BadParameter(f"model.kind = {section.kind!r} has no floor: it describes no plant")
    found = _known(floors, described, rate, period)
    if json:
        options.print_json(asdict(found))
    else:
        densities = ", ".join(f"{density:g}" for density in described.densities)
        typer.echo(_text(found, linear.signals(described.B.shape[1]).outputs, densities))
    if found.rms is None:
        raise typer.Exit(int(ExitCode.FAILED))


def design(
    config: Annotated[
        Path, typer.Option("--config", help="TOML file with a linear model and a coder `direction`.")
    ],
    out: Annotated[Path, typer.Option(help="The completed configuration, for both ends.")],
    preset: options.Preset = None,
    settings: options.Settings = None,
) -> None:
    """Complete a configuration: discretise its linear model, design its `direction` coder.

    With the narrow downlink a state feedback that runs at both ends is designed too. Run it once: give
    the same completed file to the transmitter and the receiver.

    [dim]tenbaud design --config plant.toml --out flight.toml[/dim]

    [dim]tenbaud design --config plant.toml --out flight.toml --set channel.downlink=narrow[/dim]
    """
    from tenbaud.build.downlink import designed_law
    from tenbaud.config.load import checked, merged, merged_values, read_toml, toml_text
    from tenbaud.design.complete import completed
    from tenbaud.files.whole import make_folder, write_whole

    changes = options.overrides(settings=settings)
    whole = completed(merged_values(preset, config, changes))
    own = merged(read_toml(config), changes) | {name: whole[name] for name in ("model", "coder")}
    if law := designed_law(checked(whole, config)):
        own["downlink"] = {**own.get("downlink", {}), "law": law}
    if preset is not None:
        own["preset"] = preset
    make_folder(out.parent)
    write_whole(out, toml_text(own))
    typer.echo(f"wrote {out}")


def _known(function: Any, *arguments: Any) -> Any:
    """Call a function whose ValueError is about the command's arguments."""
    try:
        return function(*arguments)
    except ValueError as error:
        raise typer.BadParameter(str(error)) from error


def _text(found: Floors, outputs: Sequence[Signal], densities: str) -> str:
    lines = [
        ("rate", f"{found.rate_bit_s:.4g} bit/s"),
        ("smallest rate", f"{found.rate_needed_bit_s:.4g} bit/s, by the data-rate theorem"),
        ("disturbance", f"densities {densities}"),
    ]
    if found.rms is None:
        lines.append(("least error", "none: at this rate it grows without bound, whatever the code"))
    else:
        for one, rms in zip(outputs, found.rms, strict=True):
            degrees = f"  ({math.degrees(rms):.3g} deg)" if one.unit == "rad" else ""
            lines.append((f"least rms {one.name}", f"{rms:.4g} {one.unit}{degrees}".rstrip()))
    if found.words_over_flow is not None:
        lines.append(("bits in words", f"{found.words_over_flow:.3f} times that"))
    width = max(len(name) for name, _ in lines)
    return "\n".join(f"{name:{width}}  {text}" for name, text in lines)
