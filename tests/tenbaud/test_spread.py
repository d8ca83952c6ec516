"""Options that commands share: seen by typer as if each command had written them itself."""

from __future__ import annotations

import inspect
from dataclasses import dataclass
from typing import Annotated

import pytest
import typer
from typer.testing import CliRunner

from tenbaud.cli.nodes import receive, transmit
from tenbaud.cli.spread import _bodies, spread


@dataclass(frozen=True)
class Shared:
    name: Annotated[str, typer.Option(help="Whose.")] = "nobody"
    many: Annotated[list[int] | None, typer.Option("--number")] = None
    plain: bool = False
    """Said below
    its field."""


@pytest.mark.parametrize("with_source", [True, False])
def test_when_options_are_spread_then_the_command_gets_them_whole(
    monkeypatch: pytest.MonkeyPatch, with_source: bool
) -> None:
    got: list[object] = []
    _bodies.cache_clear()
    if not with_source:  # installed as bytecode alone
        monkeypatch.setattr(inspect, "getsource", lambda _: (_ for _ in ()).throw(OSError))

    @spread
    def command(shared: Shared, own: bool = False) -> None:
        """Do it."""
        got.extend((shared, own))

    app = typer.Typer()
    app.command()(command)
    arguments = ["--name", "rig", "--number", "1", "--number", "2", "--own", "--plain"]
    assert CliRunner().invoke(app, arguments).exit_code == 0
    assert got == [Shared("rig", [1, 2], True), True]
    shown = CliRunner().invoke(app, ["--help"], env={"COLUMNS": "200"}).output
    assert "Do it." in shown
    assert "Whose." in shown
    assert ("Said below its field." in shown) is with_source
    assert ("--no-plain" in shown) is not with_source
    _bodies.cache_clear()


@pytest.mark.parametrize(
    ("command", "own"), [(transmit, "--dry-run"), (receive, "--take-over")], ids=["transmit", "receive"]
)
def test_when_an_end_is_asked_for_help_then_it_shows_shared_and_own_options(
    command: object, own: str
) -> None:
    app = typer.Typer()
    app.command()(command)  # type: ignore[type-var]
    shown = CliRunner().invoke(app, ["--help"], env={"COLUMNS": "200"}).output
    for option in ("--preset", "--keys", "--peer", "--router", "--scout", "--insecure", own):
        assert option in shown
    assert "--run-folder" not in shown
