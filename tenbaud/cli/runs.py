"""Commands about runs: inspect, compare, replay, audit, convert; and about presets."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path
from typing import Annotated, Literal

import typer

from tenbaud.cli import options
from tenbaud.flight.outcome import ExitCode

RunArgument = Annotated[Path, typer.Argument(help="Folder of a run, or one recording.")]


def inspect(
    run: RunArgument, json: Annotated[bool, typer.Option("--json", help="The same as JSON.")] = False
) -> None:
    """Show the content of a run's recordings: channels, units, spans, events.

    [dim]tenbaud inspect runs/2026-11-23T10-00-00_paper-10baud[/dim]
    """
    from tenbaud.flight.narrow import for_terminal
    from tenbaud.recording.inspect import describe_json, describe_text

    if json:
        options.print_json(describe_json(run))
        return
    typer.echo(for_terminal(describe_text(run)))


def diff(
    run_a: RunArgument,
    run_b: Annotated[
        Path | None, typer.Argument(help="Another; not given: compare the two ends of the first.")
    ] = None,
) -> None:
    """Find the first sample and field in which two recordings differ.

    Exit code 0: equal. 1: a value differs. 2: not comparable, because rows that both should hold
    are missing (they are listed), or there is nothing to compare.

    [dim]tenbaud diff runs/monday runs/tuesday[/dim]
    """
    from tenbaud.recording.comparison import Verdict
    from tenbaud.recording.diff import compare_runs, files_to_compare

    compared = compare_runs(run_a, run_b)
    if compared.verdict is Verdict.EQUAL:
        pairs = (f"{pair.first} and {pair.second}" for pair in files_to_compare(run_a, run_b))
        typer.echo(f"no difference between {', '.join(pairs)}")
    if text := str(compared):
        typer.echo(text)
    if compared.verdict is Verdict.DIFFERENT:
        raise typer.Exit(int(ExitCode.FAILED))
    if compared.verdict is Verdict.NOT_COMPARABLE:
        raise typer.Exit(int(ExitCode.USAGE))


def compare(
    runs: Annotated[list[Path], typer.Argument(help="Folders of two or more runs, or recordings.")],
    figure: Annotated[
        Path | None,
        typer.Option(help="Draw outputs and errors over each other into this .png, .svg or .pdf file."),
    ] = None,
    json: Annotated[
        bool, typer.Option("--json", help="The figures as JSON, in the units of the recordings.")
    ] = False,
) -> None:
    """Put the figures of runs side by side: errors, tracking, rise, overshoot, settling, bits.

    Compared are the outputs and the flight time that all runs have; what differs is noted. Exit code 2
    if they have none in common. No file is written without --figure.

    [dim]tenbaud compare runs/slow runs/fast --figure slow-and-fast.png[/dim]
    """
    from tenbaud.recording.side_by_side import compare as compare_runs
    from tenbaud.recording.style import FIGURE_FORMATS

    if figure is not None and figure.suffix not in FIGURE_FORMATS:
        raise typer.BadParameter(f"--figure {figure}: end the name in {', '.join(FIGURE_FORMATS)}")
    compared = compare_runs(*runs)
    if json:
        options.print_json(compared.as_json())
    else:
        unicode = (sys.stdout.encoding or "").lower().startswith("utf")
        typer.echo(compared.text(shutil.get_terminal_size((10_000, 24)).columns, unicode=unicode))
    if figure is not None:
        compared.plot(figure)
        typer.echo(str(figure), err=json)


def presets() -> None:
    """List the presets that come with tenbaud by plant, with their rates."""
    from tenbaud.config.load import load_config, preset_names
    from tenbaud.flight.narrow import for_terminal

    configs = {name: load_config(name) for name in preset_names()}
    plants: dict[str, list[str]] = {}
    for name, config in configs.items():
        # A linear plant is named after its preset.
        own = config.plant_kind == "linear"
        plants.setdefault(name.rpartition("-")[0] if own else config.plant_kind, []).append(name)
    width = max(map(len, configs))
    for plant in sorted(plants, key=lambda one: (one != "pitch", one)):
        typer.echo(plant)
        for name in sorted(plants[plant], key=lambda one: configs[one].channel.rate_baud):
            config = configs[name]
            line = f"  {name:{width}} {config.channel.rate_baud:7.4g} baud  {config.description}"
            typer.echo(for_terminal(line))


def convert(
    run: RunArgument,
    to: Annotated[
        Literal["csv", "mat", "parquet", "json", "mcap"],
        typer.Option(help="mcap: one file for Foxglove and PlotJuggler, with layouts."),
    ],
    out: Annotated[
        Path | None,
        typer.Option(help="File, or folder for csv and parquet; into the run's folder if not given."),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace existing files.")] = False,
) -> None:
    """Write a run for other tools, with units: all signals on one time base, samples, events.

    [dim]tenbaud convert runs/2026-11-23T10-00-00_paper-10baud --to csv[/dim]

    [dim]tenbaud convert runs/2026-11-23T10-00-00_paper-10baud --to mat --out flight.mat[/dim]
    """
    from tenbaud.recording.convert import convert as convert_run
    from tenbaud.recording.run import Run

    opened = Run(run)
    for note in opened.notes:
        typer.echo(f"note: {note}", err=True)
    for path in convert_run(opened, to, out, overwrite=force):
        typer.echo(str(path))


def recover(
    run: RunArgument,
    out: Annotated[
        Path | None,
        typer.Option(help="Path of the repaired file; the damaged file then stays in place."),
    ] = None,
) -> None:
    """Repair recordings that were truncated or damaged; the damaged files are kept.

    [dim]tenbaud recover runs/2026-11-23T10-00-00_paper-10baud[/dim]
    """
    from tenbaud.recording.recover import recover as recover_run

    for recovered in recover_run(run, out):
        typer.echo(str(recovered))


OtherRun = Annotated[
    Path | None, typer.Argument(help="Run folder of the other machine, if each recorded its own end.")
]


def replay(
    run: Annotated[Path, typer.Argument(help="Folder of a run, or a file of symbols.")],
    other: OtherRun = None,
    save: Annotated[
        Path | None, typer.Option(help="Write the symbols, the whole flight, into this new file.")
    ] = None,
    allow_code: options.AllowCode = False,
) -> None:
    """Replay a recorded flight from its symbols alone, and compare every state to the last bit.

    Exit code 1 if a state differs.

    [dim]tenbaud replay runs/2026-11-23T10-00-00_paper-10baud --save flight.symbols[/dim]

    [dim]tenbaud replay flight.symbols[/dim]
    """
    from tenbaud.replay.replay import replay_text

    if run.is_file() and run.suffix != ".mcap":
        _replay_file(run, allow_code)
        return
    from tenbaud.replay.record import load_record
    from tenbaud.replay.replay import replay as fly_again
    from tenbaud.replay.replay import save_symbols

    record = load_record(run, other, allow_code=allow_code)
    for tables in record.tables.values():
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
