"""`tenbaud export-c`: the codec of a configuration as a program in C."""

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
    """Write the codec in C99, translated from the functions of its model and its coder.

    It has the bits of the codec in Python: no heap, no library. A model or coder that is not written as
    functions of numbers is refused, with the place.

    [dim]tenbaud export-c --preset paper-10baud --out firmware[/dim]
    """
    from tenbaud.build.ends import build_observer
    from tenbaud.build.flight import agree
    from tenbaud.config.load import load_config
    from tenbaud.export.codec import codec_files
    from tenbaud.files.whole import make_folder, write_whole

    given = options.overrides(settings=settings)
    agreement = agree(load_config(preset, config, given, allow_code=allow_code), "real")
    made = codec_files(agreement.codec, agreement.terms, build_observer(agreement))
    make_folder(out)
    for name, text in made.items():
        write_whole(out / name, text)
    typer.echo(f"wrote {len(made)} files to {out}; compile them with -std=c99 -ffp-contract=off")
