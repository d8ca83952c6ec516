"""`tenbaud doctor`: is this machine fit to fly, and if not, why."""

from __future__ import annotations

import json as json_module
from dataclasses import asdict

import typer

from tenbaud.cli import options
from tenbaud.flight.outcome import ExitCode


def doctor(
    preset: options.Preset = None,
    config: options.ConfigFile = None,
    connect: options.Connect = None,
    allow_code: options.AllowCode = False,
    json: options.AsJson = False,
) -> None:
    """Look at ports, permissions, clock, arithmetic and Zenoh; print a report to paste.

    Exit code 1 if something is a problem.

    [dim]tenbaud doctor[/dim]

    [dim]tenbaud doctor --connect tcp/192.168.1.20:7447[/dim]
    """
    from tenbaud.checks.doctor import examine, report
    from tenbaud.config.load import load_config

    findings = examine(load_config(preset, config, allow_code=allow_code), tuple(connect or ()))
    if json:
        typer.echo(json_module.dumps([asdict(finding) for finding in findings], indent=2))
    else:
        typer.echo(report(findings))
    if any(finding.state == "problem" for finding in findings):
        raise typer.Exit(int(ExitCode.FAILED))
