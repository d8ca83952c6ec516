"""`tenbaud export-c`: the sensor node of a configuration as a program in C."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tenbaud.cli import options

Out = Annotated[Path, typer.Option(help="Folder for the files; those of the same names are replaced.")]


def export_c(
    out: Out,
    preset: options.Preset = None,
    config: options.ConfigFile = None,
    settings: options.Settings = None,
    allow_code: options.AllowCode = False,
) -> None:
    """Write the sensor node in C99, its codec translated from the functions of model and coder.

    It has the bits of `transmit`, and flies over a serial line with `receive`: no heap, no library. A
    model or coder that is not written as functions of numbers is refused, with the place.

    [dim]tenbaud export-c --preset paper-10baud --out firmware[/dim]
    """
    from tenbaud.build.flight import agree
    from tenbaud.config.load import load_config
    from tenbaud.export.node import node_files
    from tenbaud.files.whole import make_folder, write_whole

    given = options.overrides(settings=["link.kind=serial", *(settings or [])])
    made = node_files(agree(load_config(preset, config, given, allow_code=allow_code), "real"))
    for name, text in made.items():
        make_folder((out / name).parent)
        write_whole(out / name, text)
    typer.echo(f"wrote {len(made)} files to {out}; compile them with -std=c99 -ffp-contract=off")
