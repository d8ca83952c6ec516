"""Commands that fly a recorded flight again, and judge it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tenbaud.cli import options
from tenbaud.flight.outcome import ExitCode

OtherRun = Annotated[
    Path | None,
    typer.Argument(
        help="Run folder of the other machine, if each recorded its own end.", show_default=False
    ),
]


def replay(
    run: Annotated[Path, typer.Argument(help="Folder of a run, or a file of symbols.")],
    other: OtherRun = None,
    save: Annotated[
        Path | None, typer.Option(help="Write the symbols into this new file: the whole flight.")
    ] = None,
    allow_code: options.AllowCode = False,
) -> None:
    """Fly a recorded flight again from its symbols alone, and compare every state to the last bit.

    Exit code 1 if one differs.

    [dim]tenbaud replay runs/2026-11-23T10-00-00_paper-10baud --save flight.symbols[/dim]

    [dim]tenbaud replay flight.symbols[/dim]
    """
    from tenbaud.replay.text import replay_text

    if run.is_file() and run.suffix != ".mcap":
        _replay_file(run, allow_code)
        return
    from tenbaud.replay.record import load_record
    from tenbaud.replay.replay import replay as fly_again
    from tenbaud.replay.replay import save_symbols

    record = load_record(run, other, allow_code=allow_code)
    for _, tables in record.ends():
        for note in tables.notes:
            typer.echo(f"note: {note}", err=True)
    replayed = fly_again(record)
    typer.echo(replay_text(replayed))
    if save is not None:
        save_symbols(replayed, save)
        typer.echo(f"the flight is in {save}: {len(replayed.packed.data)} bytes")
    if not replayed.equal:
        raise typer.Exit(int(ExitCode.FAILED))


def _replay_file(path: Path, allow_code: bool) -> None:
    from tenbaud.replay.replay import replay_symbols
    from tenbaud.replay.symbols import unpack

    unpacked = unpack(path, allow_code=allow_code)
    samples, digest = replay_symbols(unpacked)
    typer.echo(f"{samples} samples flown from {path}; last state {digest}")
    if digest != unpacked.last_digest:
        typer.echo(f"but the flight ended with {unpacked.last_digest}")
        raise typer.Exit(int(ExitCode.FAILED))
    typer.echo("it is the state with which the flight ended")


def audit(
    run: Annotated[Path, typer.Argument(help="Folder of a run.")],
    other: OtherRun = None,
    allow_code: options.AllowCode = False,
) -> None:
    """Verify that a flight used only the symbols it sent, and count them.

    Exit code 1 if information leaked, or if the recordings are not sufficient to verify it.

    [dim]tenbaud audit runs/2026-11-23T10-00-00_paper-10baud[/dim]
    """
    from tenbaud.audit.audit import audit as audit_run
    from tenbaud.audit.text import audit_text

    result = audit_run(run, other, allow_code=allow_code)
    typer.echo(audit_text(result))
    if not result.passed:
        raise typer.Exit(int(ExitCode.FAILED))
