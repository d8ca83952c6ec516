"""Commands that need a checkout say so where there is none."""

from __future__ import annotations

from importlib.util import find_spec

import pytest
import typer
from typer.testing import CliRunner

from tenbaud.cli.checkout import add_commands
from tenbaud.config.load import ConfigError


@pytest.mark.parametrize("command", [["figures", "3"], ["bench", "coders", "--quick"]])
def test_when_the_generators_are_not_installed_then_the_command_says_what_to_do(
    command: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def found(name: str) -> object:
        return None if name == "reproduction" else find_spec(name)

    monkeypatch.setattr("tenbaud.cli.checkout.find_spec", found)
    app = typer.Typer()
    add_commands(app)
    result = CliRunner().invoke(app, command)
    assert isinstance(result.exception, ConfigError)
    assert "clone the repository" in str(result.exception)
